#include <memory>

#include "client/cli/bake_flags.h"
#include "client/cli/commands.h"
#include "client/cli/interrupt.h"
#include "client/cli/progress_display.h"

namespace bakewell {
namespace {

// Runs with validated settings: (settings, progress) -> summary.
using Work = std::function<absl::StatusOr<BakeSummary>(const BakeSettings&, Progress&)>;

absl::StatusOr<BakeSummary> RunWithProgress(const BakeFlags& flags, const Work& work, const Console& console) {
  BAKEWELL_RETURN_IF_ERROR(ValidateFlags(flags));
  BAKEWELL_ASSIGN_OR_RETURN(const BakeSettings settings, SettingsFromFlags(flags));
  const ProgressStyle text_style = console.err_is_terminal ? ProgressStyle::kBar : ProgressStyle::kLines;
  ProgressDisplay progress(flags.json ? console.out : console.err, flags.json ? ProgressStyle::kJson : text_style);
  const InterruptGuard guard(progress);
  return work(settings, progress);
}

int RunWork(const BakeFlags& flags, const Work& work, const Console& console) {
  const absl::StatusOr<BakeSummary> summary = RunWithProgress(flags, work, console);
  const OutputForm form = flags.json ? OutputForm::kJson : OutputForm::kText;
  if (!summary.ok()) return ReportError(summary.status(), form, console);
  PrintSummary(*summary, form, console);
  return 0;
}

}  // namespace

void AddBakeCommand(CLI::App& app, const Console& console, const Bakers& bakers, int* exit_code) {
  CLI::App* const command = app.add_subcommand("bake", "Bake a level into lightmaps, in this process");
  const auto flags = std::make_shared<BakeFlags>();
  AddSharedFlags(*command, *flags);
  AddBakeOnlyFlags(*command, *flags);
  command->footer(
      "Examples:\n"
      "  bakewell bake level.glb -o out --quality preview\n"
      "  bakewell bake level.glb -o out --uv keep --resolution 256 --target-error 0.01\n"
      "  bakewell bake level.glb -o out --environment gradient:1,2,4/1,1,1/0.2,0.2,0.2 --json");
  command->callback([flags, &console, &bakers, exit_code] {
    const Work work = [&](const BakeSettings& settings, Progress& progress) {
      return bakers.bake({flags->scene, flags->output, settings, flags->threads}, progress);
    };
    *exit_code = RunWork(*flags, work, console);
  });
}

void AddReferenceCommand(CLI::App& app, const Console& console, const Bakers& bakers, int* exit_code) {
  CLI::App* const command = app.add_subcommand("reference", "Path-trace the same texels without cache or filter");
  const auto flags = std::make_shared<BakeFlags>();
  AddSharedFlags(*command, *flags);
  AddReferenceOnlyFlags(*command, *flags);
  command->footer(
      "Examples:\n"
      "  bakewell reference level.glb -o truth --spp 4096\n"
      "  bakewell compare out/lightmap-0.irradiance.exr truth/lightmap-0.irradiance.exr --out difference.png");
  command->callback([flags, &console, &bakers, exit_code] {
    const Work work = [&](const BakeSettings& settings, Progress& progress) {
      return bakers.reference({flags->scene, flags->output, settings, flags->threads, flags->spp}, progress);
    };
    *exit_code = RunWork(*flags, work, console);
  });
}

}  // namespace bakewell
