#include <absl/strings/str_format.h>

#include "client/cli/commands.h"
#include "core/artifact/json_line.h"

namespace bakewell {
namespace {

void PrintText(const BakeSummary& summary, const Console& console) {
  for (const std::string& warning : summary.warnings) console.err << "warning: " << warning << "\n";
  console.out << absl::StrFormat("%.1f s (%.1f s CPU), %.2f million rays, estimated error %.2f %%\n",
                                 summary.wall_seconds, summary.cpu_seconds, static_cast<double>(summary.rays) * 1e-6,
                                 summary.estimated_error * 100);
  for (const std::filesystem::path& file : summary.files) console.out << file.string() << "\n";
  console.out << std::flush;
}

void PrintJson(const BakeSummary& summary, const Console& console) {
  std::vector<std::string> files;
  for (const std::filesystem::path& file : summary.files) files.push_back(file.string());
  std::vector<JsonLine> phases;
  for (const PhaseTime& phase : summary.phases) {
    phases.push_back(JsonLine()
                         .Add("phase", phase.phase)
                         .Add("wall_seconds", phase.wall_seconds)
                         .Add("cpu_seconds", phase.cpu_seconds));
  }
  JsonLine line;
  line.Add("event", "done").Add("output", summary.output_dir.string()).Add("files", files);
  line.Add("warnings", summary.warnings).Add("estimated_error", summary.estimated_error);
  line.Add("rays", summary.rays).Add("wall_seconds", summary.wall_seconds).Add("cpu_seconds", summary.cpu_seconds);
  line.Add("phases", phases);
  if (summary.peak_memory_bytes > 0) line.Add("peak_memory_bytes", summary.peak_memory_bytes);
  console.out << line.Text() << std::endl;
}

}  // namespace

void PrintSummary(const BakeSummary& summary, OutputForm form, const Console& console) {
  form == OutputForm::kJson ? PrintJson(summary, console) : PrintText(summary, console);
}

}  // namespace bakewell
