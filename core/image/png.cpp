#include "core/image/png.h"

#include <absl/strings/str_cat.h>
#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <cstring>
#include <string>

#include "core/artifact/atomic_file.h"

namespace bakewell {
namespace {

constexpr png_uint_32 kLargestSide = 1 << 16;
// Deflate cannot compress further than 1032:1.
constexpr uint64_t kLargestRatio = 1100;
constexpr uint64_t kSmallImageBytes = 1 << 16;

// Everything a decoder run owns. libpng leaves a failed run by longjmp, which skips destructors: the run's own frame
// therefore holds nothing, and all of this outlives it.
struct DecodeState {
  const std::string* bytes = nullptr;
  size_t position = 0;
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::vector<uint8_t> rgba;
  std::vector<png_bytep> rows;
  int width = 0, height = 0;
  char error[256] = "not enough memory";

  ~DecodeState() { png_destroy_read_struct(&png, &info, nullptr); }
};

[[noreturn]] void OnError(png_structp png, png_const_charp message) {
  auto* const state = static_cast<DecodeState*>(png_get_error_ptr(png));
  std::strncpy(state->error, message, sizeof(state->error) - 1);
  png_longjmp(png, 1);
}

void OnWarning(png_structp, png_const_charp) {}

void OnRead(png_structp png, png_bytep out, size_t count) {
  auto* const state = static_cast<DecodeState*>(png_get_io_ptr(png));
  if (count > state->bytes->size() - state->position) png_error(png, "the file ends too early");
  std::memcpy(out, state->bytes->data() + state->position, count);
  state->position += count;
}

// Whatever the file holds (palette, grey, 1 to 16 bits, tRNS) becomes 8-bit RGBA, its values untouched by any gamma.
void AskForRgba(png_structp png) {
  png_set_expand(png);
  png_set_scale_16(png);
  png_set_gray_to_rgb(png);
  png_set_add_alpha(png, 0xff, PNG_FILLER_AFTER);
  png_set_interlace_handling(png);
}

// Sizes the buffers by the header, whose claim is held against the size of the file first.
void PrepareRows(DecodeState& state) {
  state.width = static_cast<int>(png_get_image_width(state.png, state.info));
  state.height = static_cast<int>(png_get_image_height(state.png, state.info));
  const uint64_t packed_bytes = uint64_t{png_get_rowbytes(state.png, state.info)} * static_cast<uint64_t>(state.height);
  if (packed_bytes > std::max(kSmallImageBytes, kLargestRatio * state.bytes->size())) {
    png_error(state.png, "the header claims more pixels than the file can hold");
  }
  const size_t row_bytes = static_cast<size_t>(state.width) * 4;
  state.rgba.resize(row_bytes * static_cast<size_t>(state.height));
  for (int y = 0; y < state.height; ++y) state.rows.push_back(state.rgba.data() + row_bytes * static_cast<size_t>(y));
}

bool RunDecoder(DecodeState& state) {
  if (setjmp(png_jmpbuf(state.png))) return false;
  png_set_user_limits(state.png, kLargestSide, kLargestSide);
  png_set_read_fn(state.png, &state, OnRead);
  png_read_info(state.png, state.info);
  PrepareRows(state);
  AskForRgba(state.png);
  png_read_update_info(state.png, state.info);
  png_read_image(state.png, state.rows.data());
  png_read_end(state.png, nullptr);
  return true;
}

Image ImageOfRgba(const DecodeState& state) {
  Image image(state.width, state.height, {"R", "G", "B", "A"});
  for (size_t i = 0; i < image.PixelCount(); ++i) {
    for (int c = 0; c < 4; ++c) {
      image.Channel(c)[i] = static_cast<float>(state.rgba[4 * i + static_cast<size_t>(c)]) / 255.0f;
    }
  }
  return image;
}

}  // namespace

absl::StatusOr<std::string> PngBytes(int width, int height, std::span<const uint8_t> rgb) {
  if (width <= 0 || height <= 0) return absl::InvalidArgumentError("the image has no pixels");
  BAKEWELL_CHECK_OP(rgb.size(), ==, size_t{3} * static_cast<size_t>(width) * static_cast<size_t>(height));
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;  // a third larger, half the time
  png_alloc_size_t size_bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string bytes(size_bytes, '\0');
  const int as_is = 0;
  if (!png_image_write_to_memory(&image, bytes.data(), &size_bytes, as_is, rgb.data(), 3 * width, nullptr)) {
    return absl::UnavailableError(absl::StrCat("libpng cannot encode it: ", image.message));
  }
  bytes.resize(size_bytes);
  return bytes;
}

absl::Status WritePng(const std::filesystem::path& path, int width, int height, std::span<const uint8_t> rgb) {
  const auto bytes = PngBytes(width, height, rgb);
  if (!bytes.ok()) {
    return absl::Status(bytes.status().code(), absl::StrCat(path.string(), ": ", bytes.status().message()));
  }
  return WriteFileAtomically(path, *bytes);
}

absl::StatusOr<Image> ReadPng(const std::filesystem::path& path) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  DecodeState state;
  state.bytes = &bytes;
  state.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &state, OnError, OnWarning);
  if (state.png != nullptr) state.info = png_create_info_struct(state.png);
  if (state.info == nullptr || !RunDecoder(state)) {
    return absl::InvalidArgumentError(absl::StrCat(path.string(), ": not a readable PNG image: ", state.error));
  }
  return ImageOfRgba(state);
}

}  // namespace bakewell
