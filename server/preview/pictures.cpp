#include "server/preview/pictures.h"

#include <absl/strings/strip.h>

#include <algorithm>

#include "core/image/png.h"

namespace bakewell::preview {

absl::Status Canvas::Add(const PagePreview& part) {
  if (width_ == 0) {
    width_ = part.width;
    height_ = part.height;
    while (std::max(width_, height_) > kMaxSide * shrink_) shrink_ *= 2;
    sums_ = Image((width_ + shrink_ - 1) / shrink_, (height_ + shrink_ - 1) / shrink_, {"R", "G", "B", "A"});
  }
  if (part.width != width_ || part.height != height_) return absl::InvalidArgumentError("a preview of another page");
  for (const PagePreview::Block& block : part.blocks) {
    const int x = block.x / shrink_, y = block.y / shrink_;
    sums_.At(0, x, y) += block.irradiance.x;
    sums_.At(1, x, y) += block.irradiance.y;
    sums_.At(2, x, y) += block.irradiance.z;
    sums_.At(3, x, y) += 1;
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> Canvas::Png() const {
  if (width_ == 0) return absl::NotFoundError("nothing of the picture is there yet");
  Image mean = sums_;
  for (size_t i = 0; i < mean.PixelCount(); ++i) {
    const float blocks = std::max(1.0f, sums_.Channel(3)[i]);
    for (int c = 0; c < 3; ++c) mean.Channel(c)[i] /= blocks;
  }
  return PngBytes(mean.width, mean.height, TonemapPreview(mean));
}

Pictures::Growing& Pictures::Find(const Key& key) {
  constexpr size_t kKept = 16;
  const auto found =
      std::find_if(recent_.begin(), recent_.end(), [&](const auto& entry) { return entry.first == key; });
  if (found != recent_.end())
    recent_.splice(recent_.begin(), recent_, found);
  else
    recent_.emplace_front(key, Growing{});
  if (recent_.size() > kKept) recent_.pop_back();
  return recent_.front().second;
}

absl::StatusOr<std::string> Pictures::Png(int64_t job, std::string_view name) {
  const std::string picture(absl::StripSuffix(absl::string_view(name.data(), name.size()), ".png"));
  // One at a time: a canvas grows once, whoever asks.
  const std::lock_guard lock(mutex_);
  Growing& growing = Find({job, picture});
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<Digest> parts, coordinator_.PreviewParts(job, picture, growing.parts));
  for (const Digest& digest : parts) {
    ++growing.parts;
    const auto bytes = coordinator_.blobs().Get(digest);
    if (!bytes.ok()) continue;  // lost: its task runs again where somebody needs it
    const auto part = ParsePreview(*bytes);
    if (part.ok()) growing.canvas.Add(*part).IgnoreError();  // a worker's nonsense spoils no picture
  }
  return growing.canvas.Png();
}

}  // namespace bakewell::preview
