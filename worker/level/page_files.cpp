#include "worker/level/page_files.h"

#include <absl/strings/str_cat.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "core/image/exr.h"
#include "core/image/png.h"
#include "worker/finish/charts.h"

namespace bakewell {

namespace {

namespace fs = std::filesystem;

// A folder for the encoders, which write files; in memory where the system has such a place.
class Scratch {
 public:
  Scratch() {
    static std::atomic<int> next{0};
    std::error_code error;
    const fs::path base = fs::exists("/dev/shm", error) ? fs::path("/dev/shm") : fs::temp_directory_path();
    path_ = base / absl::StrCat("bakewell-page-", getpid(), "-", next++);
    fs::create_directory(path_, error);
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

absl::Status Take(const fs::path& path, MadeOutputs& outputs) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::UnavailableError(absl::StrCat("cannot read ", path.string()));
  outputs.push_back({path.filename().string(), std::string(std::istreambuf_iterator<char>(file), {})});
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<MadeOutputs> PageFiles(const TexelMap& map, std::span<const TexelLight> lights, int page) {
  if (page < 0 || page >= static_cast<int>(map.pages.size())) return absl::InvalidArgumentError("no such page");
  const PageImages images = FinishPage(map, lights, page);
  const Scratch scratch;
  const std::string stem = (scratch.path() / absl::StrCat("lightmap-", page)).string();
  BAKEWELL_RETURN_IF_ERROR(WriteExr(stem + ".irradiance.exr", images.irradiance));
  BAKEWELL_RETURN_IF_ERROR(WriteExr(stem + ".sh.exr", images.sh));
  BAKEWELL_RETURN_IF_ERROR(WriteExr(stem + ".variance.exr", images.variance));
  BAKEWELL_RETURN_IF_ERROR(
      WritePng(stem + ".png", images.irradiance.width, images.irradiance.height, TonemapPreview(images.irradiance)));
  MadeOutputs outputs;
  for (const char* ending : {".irradiance.exr", ".png", ".sh.exr", ".variance.exr"}) {
    BAKEWELL_RETURN_IF_ERROR(Take(stem + ending, outputs));
  }
  outputs.push_back(
      {absl::StrCat("lightmap-", page, ".charts.json"), ChartsJson(page, SummarizeCharts(map, lights, page))});
  return outputs;
}

}  // namespace bakewell
