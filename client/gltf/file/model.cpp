#include "client/gltf/file/model.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

namespace bakewell::gltf {
namespace {

using nlohmann::json;

// What tinygltf is given, so that its parser meets nothing but checked members.
constexpr const char* kKeptArrays[] = {"accessors", "bufferViews", "meshes", "nodes", "scenes", "textures", "samplers"};

void DropUnchecked(json& element) {
  for (const char* name : {"extras", "extensions", "weights", "targets"}) element.erase(name);
  if (const auto primitives = element.find("primitives"); primitives != element.end()) {
    for (json& primitive : *primitives) DropUnchecked(primitive);
  }
}

json CheckedPart(const json& document) {
  json part;
  part["asset"]["version"] = "2.0";
  for (const char* name : kKeptArrays) {
    const auto it = document.find(name);
    if (it == document.end()) continue;
    part[name] = *it;
    for (json& element : part[name]) DropUnchecked(element);
  }
  return part;
}

struct ImageSize {
  int64_t width = 0, height = 0;
};

int64_t BigEndian(std::string_view bytes, size_t offset, size_t count) {
  int64_t value = 0;
  for (size_t i = 0; i < count; ++i) value = value * 256 + static_cast<uint8_t>(bytes[offset + i]);
  return value;
}

absl::StatusOr<ImageSize> PngSize(std::string_view bytes) {
  if (bytes.size() < 24) return absl::InvalidArgumentError("the PNG ends inside its header");
  return ImageSize{BigEndian(bytes, 16, 4), BigEndian(bytes, 20, 4)};
}

bool IsFrameMarker(uint8_t marker) {
  return marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC;
}

// The size in the first frame header, which is the one that a decoder takes.
absl::StatusOr<ImageSize> JpegSize(std::string_view bytes) {
  for (size_t at = 2; at + 9 <= bytes.size();) {
    if (static_cast<uint8_t>(bytes[at]) != 0xFF) return absl::InvalidArgumentError("the JPEG has a malformed marker");
    const auto marker = static_cast<uint8_t>(bytes[at + 1]);
    if (marker == 0xFF) {
      ++at;
      continue;
    }
    if (IsFrameMarker(marker)) return ImageSize{BigEndian(bytes, at + 7, 2), BigEndian(bytes, at + 5, 2)};
    at += 2 + static_cast<size_t>(BigEndian(bytes, at + 2, 2));
  }
  return absl::InvalidArgumentError("the JPEG has no frame header");
}

absl::StatusOr<ImageSize> AnnouncedSize(std::string_view bytes) {
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return PngSize(bytes);
  if (bytes.starts_with("\xFF\xD8\xFF")) return JpegSize(bytes);
  return absl::InvalidArgumentError("it is neither PNG nor JPEG");
}

// 16-bit channels keep their upper byte.
std::vector<uint8_t> To8Bit(const std::vector<uint8_t>& bytes16) {
  std::vector<uint8_t> bytes(bytes16.size() / 2);
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = bytes16[2 * i + 1];
  return bytes;
}

absl::StatusOr<Pixels> ToPixels(tinygltf::Image image) {
  if (image.bits == 16) image.image = To8Bit(image.image);
  const size_t expected = 4 * static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
  if (image.image.size() != expected) return absl::InvalidArgumentError("it does not decode to RGBA pixels");
  return Pixels{image.width, image.height, std::move(image.image)};
}

}  // namespace

absl::StatusOr<tinygltf::Model> ToModel(const Document& document) {
  tinygltf::Model model;
  std::string error, warning;
  try {
    const std::string text = CheckedPart(document.json).dump();
    tinygltf::TinyGLTF loader;
    if (text.size() > std::numeric_limits<unsigned int>::max()) return absl::InvalidArgumentError("4 GiB of JSON");
    const auto length = static_cast<unsigned int>(text.size());
    if (loader.LoadASCIIFromString(&model, &error, &warning, text.c_str(), length, "")) return model;
  } catch (const std::exception& exception) {
    error = exception.what();
  }
  return absl::InvalidArgumentError(absl::StrCat("glTF: ", absl::StripSuffix(error, "\n")));
}

absl::StatusOr<Pixels> DecodeImage(std::string_view bytes, int64_t max_pixels) {
  BAKEWELL_ASSIGN_OR_RETURN(const ImageSize size, AnnouncedSize(bytes));
  if (size.width < 1 || size.height < 1 || size.width > max_pixels / size.height) {
    return absl::InvalidArgumentError(
        absl::StrCat("it announces ", size.width, " x ", size.height, " pixels, 1 to ", max_pixels, " are read"));
  }
  tinygltf::Image image;
  std::string error, warning;
  const auto* data = reinterpret_cast<const unsigned char*>(bytes.data());
  try {
    const auto length = static_cast<int>(std::min<size_t>(bytes.size(), std::numeric_limits<int>::max()));
    if (tinygltf::LoadImageData(&image, 0, &error, &warning, static_cast<int>(size.width),
                                static_cast<int>(size.height), data, length, nullptr)) {
      return ToPixels(std::move(image));
    }
  } catch (const std::exception& exception) {
    error = exception.what();
  }
  return absl::InvalidArgumentError("it cannot be decoded");
}

}  // namespace bakewell::gltf
