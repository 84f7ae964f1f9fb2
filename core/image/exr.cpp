#include "core/image/exr.h"

#include <ImathBox.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cstring>
#include <set>
#include <stdexcept>

#include "core/artifact/atomic_file.h"

namespace bakewell {
namespace {

constexpr int kThisThreadOnly = 0;
constexpr int kLargestSide = 1 << 16;
// ZIP cannot compress further than 1032:1; a header that claims far more than its file can hold is a lie.
constexpr uint64_t kLargestRatio = 4096;
constexpr uint64_t kSmallImageBytes = 1 << 20;

// OpenEXR writes into memory; the file itself is written atomically afterwards.
class MemoryOut : public Imf::OStream {
 public:
  explicit MemoryOut(size_t expected_bytes) : Imf::OStream("memory") { bytes_.reserve(expected_bytes); }
  void write(const char bytes[], int count) override {
    if (position_ > bytes_.size()) bytes_.resize(position_);
    bytes_.replace(position_, static_cast<size_t>(count), bytes, static_cast<size_t>(count));
    position_ += static_cast<size_t>(count);
  }
  uint64_t tellp() override { return position_; }
  void seekp(uint64_t position) override { position_ = position; }
  std::string bytes() && { return std::move(bytes_); }

 private:
  std::string bytes_;
  size_t position_ = 0;
};

class MemoryIn : public Imf::IStream {
 public:
  MemoryIn(const std::string& bytes, const std::string& name) : Imf::IStream(name.c_str()), bytes_(bytes) {}
  bool read(char out[], int count) override {
    const size_t wanted = static_cast<size_t>(std::max(count, 0));
    if (position_ > bytes_.size() || wanted > bytes_.size() - position_) {
      throw std::runtime_error("the file ends too early");
    }
    std::memcpy(out, bytes_.data() + position_, wanted);
    position_ += wanted;
    return position_ < bytes_.size();
  }
  uint64_t tellg() override { return position_; }
  void seekg(uint64_t position) override { position_ = position; }

 private:
  const std::string& bytes_;
  uint64_t position_ = 0;
};

absl::Status CheckWritable(const Image& image) {
  if (image.width <= 0 || image.height <= 0) return absl::InvalidArgumentError("the image has no pixels");
  if (image.channels.empty()) return absl::InvalidArgumentError("the image has no channels");
  const std::set<std::string> names(image.channels.begin(), image.channels.end());
  if (names.size() != image.channels.size()) return absl::InvalidArgumentError("two channels share a name");
  if (names.contains("")) return absl::InvalidArgumentError("a channel has no name");
  return absl::OkStatus();
}

// A slice over one planar channel whose pixel (min_x, min_y) is *first.
Imf::Slice PlanarSlice(float* first, const Imath::Box2i& window) {
  return Imf::Slice::Make(Imf::FLOAT, first, window, sizeof(float));
}

std::string EncodeExr(const Image& image) {
  Imf::Header header(image.width, image.height);
  // Noise does not compress: ZIP makes pages 8 % smaller than RLE and takes six times as long, a tenth of a preview.
  header.compression() = Imf::RLE_COMPRESSION;
  Imf::FrameBuffer pixels;
  for (size_t c = 0; c < image.channels.size(); ++c) {
    header.channels().insert(image.channels[c], Imf::Channel(Imf::FLOAT));
    float* const first = const_cast<float*>(image.Channel(static_cast<int>(c)).data());
    pixels.insert(image.channels[c], PlanarSlice(first, header.dataWindow()));
  }
  // Lines that would grow are stored as they are.
  constexpr size_t kHeadBytes = 4096, kLineBytes = 16;
  MemoryOut stream(image.data.size() * sizeof(float) + kHeadBytes + kLineBytes * static_cast<size_t>(image.height));
  {
    Imf::OutputFile file(stream, header, kThisThreadOnly);
    file.setFrameBuffer(pixels);
    file.writePixels(image.height);
  }
  return std::move(stream).bytes();
}

// Throws where the header claims what we do not read or what the file cannot hold; else an image of that shape.
Image ImageForHeader(const Imf::Header& header, uint64_t file_size_bytes) {
  const Imath::Box2i& window = header.dataWindow();
  Image image;
  image.width = window.max.x - window.min.x + 1;
  image.height = window.max.y - window.min.y + 1;
  for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
    const bool full = channel.channel().xSampling == 1 && channel.channel().ySampling == 1;
    if (!full) throw std::runtime_error(absl::StrCat("channel ", channel.name(), " is subsampled"));
    image.channels.emplace_back(channel.name());
  }
  if (image.channels.empty()) throw std::runtime_error("it has no channels");
  const uint64_t size_bytes = image.PixelCount() * image.channels.size() * sizeof(float);
  if (size_bytes > std::max(kSmallImageBytes, kLargestRatio * file_size_bytes)) {
    throw std::runtime_error(absl::StrCat("it claims ", size_bytes, " bytes of pixels, more than the file can hold"));
  }
  image.data.resize(image.PixelCount() * image.channels.size());
  return image;
}

Image DecodeExr(const std::string& bytes, const std::string& name) {
  // Process-wide limit of OpenEXR, which it checks before it allocates anything by the header's word.
  [[maybe_unused]] static const bool limited = (Imf::Header::setMaxImageSize(kLargestSide, kLargestSide), true);
  MemoryIn stream(bytes, name);
  Imf::InputFile file(stream, kThisThreadOnly);
  const Imath::Box2i window = file.header().dataWindow();
  Image image = ImageForHeader(file.header(), bytes.size());
  Imf::FrameBuffer pixels;
  for (size_t c = 0; c < image.channels.size(); ++c) {
    pixels.insert(image.channels[c], PlanarSlice(image.Channel(static_cast<int>(c)).data(), window));
  }
  file.setFrameBuffer(pixels);
  file.readPixels(window.min.y, window.max.y);
  return image;
}

}  // namespace

absl::StatusOr<std::string> ExrBytes(const Image& image) {
  BAKEWELL_RETURN_IF_ERROR(CheckWritable(image));
  try {
    return EncodeExr(image);
  } catch (const std::exception& error) {
    return absl::UnavailableError(absl::StrCat("OpenEXR cannot encode it: ", error.what()));
  }
}

absl::Status WriteExr(const std::filesystem::path& path, const Image& image) {
  const auto bytes = ExrBytes(image);
  if (bytes.ok()) return WriteFileAtomically(path, *bytes);
  return absl::Status(bytes.status().code(), absl::StrCat(path.string(), ": ", bytes.status().message()));
}

absl::StatusOr<Image> ReadExr(const std::filesystem::path& path) {
  BAKEWELL_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path));
  try {
    return DecodeExr(bytes, path.string());
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat(path.string(), ": not a readable EXR image: ", error.what()));
  }
}

}  // namespace bakewell
