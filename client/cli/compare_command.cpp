#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <memory>
#include <optional>

#include "client/cli/commands.h"
#include "core/artifact/json_line.h"
#include "core/image/compare.h"
#include "core/image/exr.h"
#include "core/image/png.h"

namespace bakewell {
namespace {

struct CompareFlags {
  std::string candidate, reference;
  std::string mask, backface, standard_error, picture;
  std::vector<std::string> halves;
  int min_mask = 255;
  bool json = false;
};

// What the flags name, read.
struct CompareInputs {
  Image candidate, reference;
  TexelMask mask;
  std::vector<Image> halves;  // 0 or 2
  std::optional<Image> standard_error;

  Comparison View() const {
    Comparison view{&candidate, &reference, &mask};
    if (halves.size() == 2) view.half_a = &halves[0], view.half_b = &halves[1];
    if (standard_error) view.standard_error = &*standard_error;
    return view;
  }
};

struct CompareResult {
  ErrorFigures figures;
  std::optional<double> picture_scale;
};

absl::StatusOr<TexelMask> ReadMask(const CompareFlags& flags, const Image& candidate) {
  TexelMask mask = MaskFromCoverage(candidate);
  if (!flags.mask.empty()) {
    BAKEWELL_ASSIGN_OR_RETURN(const Image picture, ReadPng(flags.mask));
    BAKEWELL_ASSIGN_OR_RETURN(mask, MaskFromPicture(picture, flags.min_mask));
  }
  if (flags.backface.empty()) return mask;
  BAKEWELL_ASSIGN_OR_RETURN(const Image backface, ReadExr(flags.backface));
  return WithoutBackfaces(std::move(mask), backface);
}

absl::StatusOr<CompareInputs> ReadInputs(const CompareFlags& flags) {
  CompareInputs inputs;
  BAKEWELL_ASSIGN_OR_RETURN(inputs.candidate, ReadExr(flags.candidate));
  BAKEWELL_ASSIGN_OR_RETURN(inputs.reference, ReadExr(flags.reference));
  BAKEWELL_ASSIGN_OR_RETURN(inputs.mask, ReadMask(flags, inputs.candidate));
  for (const std::string& half : flags.halves) {
    BAKEWELL_ASSIGN_OR_RETURN(Image image, ReadExr(half));
    inputs.halves.push_back(std::move(image));
  }
  if (!flags.standard_error.empty()) {
    BAKEWELL_ASSIGN_OR_RETURN(inputs.standard_error, ReadExr(flags.standard_error));
  }
  return inputs;
}

absl::StatusOr<CompareResult> Compare(const CompareFlags& flags) {
  BAKEWELL_ASSIGN_OR_RETURN(const CompareInputs inputs, ReadInputs(flags));
  CompareResult result;
  BAKEWELL_ASSIGN_OR_RETURN(result.figures, CompareImages(inputs.View()));
  if (flags.picture.empty()) return result;
  BAKEWELL_ASSIGN_OR_RETURN(const DifferencePicture picture, DrawDifference(inputs.View()));
  BAKEWELL_RETURN_IF_ERROR(WritePng(flags.picture, inputs.mask.width, inputs.mask.height, picture.rgb));
  result.picture_scale = picture.scale;
  return result;
}

// Names as reference/compare.py prints them, so that one reader reads both.
void PrintJson(const CompareResult& result, const Console& console) {
  const ErrorFigures& f = result.figures;
  JsonLine line;
  line.Add("texels", f.texels).Add("meanRef", f.mean_reference).Add("meanCand", f.mean_candidate).Add("bias", f.bias);
  line.Add("relRMSE", f.rel_rmse).Add("relMSE", f.rel_mse).Add("p50", f.p50).Add("p95", f.p95);
  line.Add("nonfinite", f.nonfinite);
  if (f.reference_noise) line.Add("refNoise", *f.reference_noise);
  if (f.rel_rmse_debiased) line.Add("relRMSE_debiased", *f.rel_rmse_debiased);
  if (f.rel_rmse_cross) line.Add("relRMSE_cross", *f.rel_rmse_cross);
  if (result.picture_scale) line.Add("differenceScale", *result.picture_scale);
  console.out << line.Text() << std::endl;
}

void PrintPercent(const char* name, std::optional<double> value, const Console& console) {
  if (value) console.out << absl::StrFormat("%-17s %10.4f %%\n", name, *value * 100);
}

void PrintText(const CompareResult& result, const CompareFlags& flags, const Console& console) {
  const ErrorFigures& f = result.figures;
  console.out << absl::StrFormat("%-17s %10d\n", "texels", f.texels);
  console.out << absl::StrFormat("%-17s %10.6g W/m2\n", "mean reference", f.mean_reference);
  console.out << absl::StrFormat("%-17s %10.6g W/m2\n", "mean candidate", f.mean_candidate);
  PrintPercent("bias", f.bias, console);
  PrintPercent("relRMSE", f.rel_rmse, console);
  PrintPercent("relRMSE cross", f.rel_rmse_cross, console);
  PrintPercent("relRMSE debiased", f.rel_rmse_debiased, console);
  PrintPercent("reference noise", f.reference_noise, console);
  PrintPercent("p50", f.p50, console);
  PrintPercent("p95", f.p95, console);
  console.out << absl::StrFormat("%-17s %10.6g\n", "relMSE", f.rel_mse);
  if (f.nonfinite > 0) console.out << absl::StrFormat("%-17s %10d  NaN or infinite\n", "not finite", f.nonfinite);
  if (result.picture_scale) {
    console.out << absl::StrFormat("%s: blue is -%.4g W/m2, red is +%.4g W/m2\n", flags.picture, *result.picture_scale,
                                   *result.picture_scale);
  }
  console.out << std::flush;
}

int RunCompare(const CompareFlags& flags, const Console& console) {
  const absl::StatusOr<CompareResult> result = Compare(flags);
  if (!result.ok()) {
    return ReportError(result.status(), flags.json ? OutputForm::kJson : OutputForm::kText, console);
  }
  flags.json ? PrintJson(*result, console) : PrintText(*result, flags, console);
  return 0;
}

}  // namespace

void AddCompareCommand(CLI::App& app, const Console& console, int* exit_code) {
  CLI::App* const command = app.add_subcommand("compare", "Measure a lightmap against a reference");
  const auto flags = std::make_shared<CompareFlags>();
  command->add_option("candidate", flags->candidate, "EXR with R, G, B: irradiance [W/m2]")->required();
  command->add_option("reference", flags->reference, "EXR of the same size")->required();
  CLI::Option* const mask =
      command->add_option("--mask", flags->mask, "PNG; without it, texels where the candidate's A is above 0, or all");
  command->add_option("--min-mask", flags->min_mask, "Mask values from this on count, 0 to 255")
      ->check(CLI::Range(0, 255))
      ->needs(mask)
      ->capture_default_str();
  command->add_option("--clean", flags->backface, "EXR: share of back faces seen; texels from 0.02 on do not count");
  command->add_option("--halves", flags->halves, "Two independent halves of the reference, EXR")->expected(2);
  command->add_option("--stderr", flags->standard_error, "EXR: the reference's standard error of the luminance");
  command->add_option("--out", flags->picture, "Write the difference as a PNG: blue darker, red brighter");
  command->add_flag("--json", flags->json, "One JSON object on standard output");
  command->footer(
      "Examples:\n"
      "  bakewell compare out/lightmap-0.irradiance.exr truth.exr --mask interior.png --out difference.png\n"
      "  bakewell compare out/lightmap-0.irradiance.exr truth.exr --halves truth_A.exr truth_B.exr --json");
  command->callback([flags, &console, exit_code] { *exit_code = RunCompare(*flags, console); });
}

}  // namespace bakewell
