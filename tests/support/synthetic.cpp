#include "tests/support/synthetic.h"

#include <absl/strings/str_cat.h>

#include <chrono>
#include <cstdio>
#include <new>
#include <thread>

namespace bakewell::test {

namespace {

using std::chrono::microseconds;

constexpr int kMaxTasks = 200000;

absl::StatusOr<SyntheticScene> ParseScene(const std::string& text) {
  SyntheticScene scene;
  int two_stages = 0;
  const int read = std::sscanf(text.c_str(), "synthetic %d %d %d %d %d %d %d", &scene.width, &scene.layers,
                               &scene.work_us, &scene.spin_hashes, &scene.bytes, &scene.seed, &two_stages);
  const bool sound = read == 7 && scene.width > 0 && scene.layers > 0 && scene.bytes > 0 && scene.bytes < (64 << 20) &&
                     int64_t{scene.width} * scene.layers <= kMaxTasks;
  if (!sound) return absl::InvalidArgumentError("the scene is malformed: it is not a synthetic scene");
  scene.two_stages = two_stages != 0;
  return scene;
}

plan::PlannedTask MakeTask(TaskSpec spec, const SyntheticScene& scene) {
  plan::PlannedTask task;
  task.key = KeyOf(spec);
  task.spec = std::move(spec);
  task.cost = microseconds(std::max(1000, scene.work_us + scene.spin_hashes * 60));
  task.memory_bytes = 1 << 20;
  return task;
}

std::string WorkSettings(const SyntheticScene& scene, int index) {
  FieldWriter writer;
  writer.Put(static_cast<uint32_t>(index));
  writer.Put(static_cast<uint32_t>(scene.seed));
  writer.Put(static_cast<uint32_t>(scene.work_us));
  writer.Put(static_cast<uint32_t>(scene.spin_hashes));
  writer.Put(static_cast<uint32_t>(scene.bytes));
  return std::move(writer).bytes();
}

plan::PlannedTask RootTask(const Digest& scene_digest, const SyntheticScene& scene) {
  return MakeTask({"test/root", 1, WorkSettings(scene, 0), {{"scene", scene_digest}}}, scene);
}

void AddLayers(const TaskKey& root, const SyntheticScene& scene, plan::TaskGraph& graph) {
  std::vector<TaskKey> before(static_cast<size_t>(scene.width), root);
  for (int layer = 0; layer < scene.layers; ++layer) {
    std::vector<TaskKey> now;
    for (int i = 0; i < scene.width; ++i) {
      TaskSpec spec{"test/chain", 1, WorkSettings(scene, layer * scene.width + i + 1), {}};
      spec.inputs.push_back({"left", OutputOf{before[i], "out"}});
      spec.inputs.push_back({"right", OutputOf{before[(i + 1) % scene.width], "out"}});
      graph.tasks.push_back(MakeTask(std::move(spec), scene));
      now.push_back(graph.tasks.back().key);
    }
    before = std::move(now);
  }
  TaskSpec join{"test/join", 1, WorkSettings(scene, -1), {}};
  for (int i = 0; i < scene.width; ++i) {
    join.inputs.push_back({absl::StrCat("in", i), OutputOf{before[i], "out"}});
  }
  graph.artifacts.push_back({"preview/first.bin", {before[0], "out"}});
  graph.tasks.push_back(MakeTask(std::move(join), scene));
  graph.deliver.push_back(graph.tasks.back().key);
}

void Sleep(microseconds time, const std::stop_token& stop) {
  const auto until = std::chrono::steady_clock::now() + time;
  while (!stop.stop_requested() && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::min<microseconds>(time, microseconds(2000)));
  }
}

Digest Spin(Digest digest, uint32_t hashes, const std::stop_token& stop) {
  std::string block(64 << 10, '\0');
  for (uint32_t i = 0; i < hashes && !stop.stop_requested(); ++i) {
    block.replace(0, 32, DigestToBytes(digest));
    digest = Sha256Of(block);
  }
  return digest;
}

// A stream of bytes that the digest decides.
std::string Expand(Digest digest, size_t size_bytes) {
  std::string bytes;
  while (bytes.size() < size_bytes) {
    bytes += DigestToBytes(digest);
    digest = Sha256Of(DigestToBytes(digest));
  }
  bytes.resize(size_bytes);
  return bytes;
}

}  // namespace

std::string SyntheticScene::Text() const {
  return absl::StrCat("synthetic ", width, " ", layers, " ", work_us, " ", spin_hashes, " ", bytes, " ", seed, " ",
                      two_stages ? 1 : 0);
}

std::vector<plan::Kind> SyntheticPlanner::Kinds() const {
  return {{"test/root", 1}, {"test/chain", 1}, {"test/join", 1}};
}

absl::StatusOr<plan::TaskGraph> SyntheticPlanner::Plan(const plan::PlanRequest& request,
                                                       const plan::BlobReader& read) const {
  if (request.settings == "unknown") return absl::InvalidArgumentError("unknown settings");
  if (request.settings == "throw") throw std::bad_alloc();
  BAKEWELL_ASSIGN_OR_RETURN(const std::string text, read(request.scene));
  BAKEWELL_ASSIGN_OR_RETURN(const SyntheticScene scene, ParseScene(text));
  plan::TaskGraph graph;
  graph.tasks.push_back(RootTask(request.scene, scene));
  const TaskKey root = graph.tasks.back().key;
  if (scene.two_stages)
    graph.next_stage_after = root;
  else
    AddLayers(root, scene, graph);
  return graph;
}

absl::StatusOr<plan::TaskGraph> SyntheticPlanner::Continue(const plan::PlanRequest& request,
                                                           const std::vector<plan::TaskGraph>& so_far,
                                                           const TaskOutputs&, const plan::BlobReader& read) const {
  if (request.settings == "throw later") throw std::bad_alloc();
  BAKEWELL_ASSIGN_OR_RETURN(const std::string text, read(request.scene));
  BAKEWELL_ASSIGN_OR_RETURN(const SyntheticScene scene, ParseScene(text));
  plan::TaskGraph graph;
  AddLayers(so_far[0].tasks[0].key, scene, graph);
  return graph;
}

std::vector<TaskKind> SyntheticExecutor::Kinds() const {
  return {{"test/root", 1}, {"test/chain", 1}, {"test/join", 1}};
}

absl::StatusOr<MadeOutputs> SyntheticExecutor::Run(const TaskSpec& spec, const TaskInputs& inputs,
                                                   std::stop_token stop) {
  ++runs;
  if (before) BAKEWELL_RETURN_IF_ERROR(before(spec));
  FieldReader settings(spec.settings);
  settings.Get<uint64_t>();  // index and seed: only their bytes count
  const auto work = microseconds(settings.Get<uint32_t>());
  const uint32_t hashes = settings.Get<uint32_t>(), size_bytes = settings.Get<uint32_t>();
  BAKEWELL_RETURN_IF_ERROR(settings.Finish("synthetic settings"));
  FieldWriter seed;
  seed.PutString(spec.settings);
  for (const auto& [name, blob] : inputs) seed.PutDigest(Sha256Of(*blob));
  const Digest digest = Spin(Sha256Of(seed.bytes()), hashes, stop);
  Sleep(work, stop);
  if (stop.stop_requested() && careless) return MadeOutputs{{"out", "a part"}};
  if (stop.stop_requested()) return absl::CancelledError("stopped");
  MadeOutputs made = {{"out", Expand(digest, size_bytes)}};
  if (after) after(made);
  return made;
}

}  // namespace bakewell::test
