#include "client/gltf/file/accessor.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "client/gltf/file/schema.h"

namespace bakewell::gltf {
namespace {

// Where the elements of an accessor, or of one half of its sparse part, lie.
struct Layout {
  std::string_view bytes;  // from the first element on
  size_t stride = 0, component_bytes = 0;
  int components = 0, component_type = 0;
  bool normalized = false;
};

// One accessor, checked and read. Every method returns errors that name it.
class AccessorReader {
 public:
  AccessorReader(const Source& source, int index)
      : source_(source), index_(index), accessor_(source.model.accessors[static_cast<size_t>(index)]) {}

  absl::StatusOr<std::vector<double>> Read(int components) const {
    BAKEWELL_RETURN_IF_ERROR(CheckType(components));
    std::vector<double> values;
    if (accessor_.bufferView >= 0) {
      BAKEWELL_ASSIGN_OR_RETURN(const Layout layout, Main(components));
      values.resize(accessor_.count * static_cast<size_t>(components));
      for (size_t i = 0; i < accessor_.count; ++i) Decode(layout, i, &values[i * static_cast<size_t>(components)]);
    } else {
      BAKEWELL_RETURN_IF_ERROR(CheckUnbacked());
      values.resize(accessor_.count * static_cast<size_t>(components), 0.0);
    }
    if (accessor_.sparse.isSparse) BAKEWELL_RETURN_IF_ERROR(ApplySparse(components, values));
    return values;
  }

  absl::Status Error(const std::string& reason) const {
    return absl::InvalidArgumentError(absl::StrCat(NameOf(source_.document.json, "accessors", index_), ": ", reason));
  }

  absl::StatusOr<Elements> Gather(std::span<const uint32_t> which) const {
    const int components = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor_.type));
    const bool plain = accessor_.bufferView >= 0 && !accessor_.sparse.isSparse;
    if (!plain) return GatherFloats(which, components);
    BAKEWELL_RETURN_IF_ERROR(CheckType(components));
    BAKEWELL_ASSIGN_OR_RETURN(Layout layout, Main(components));
    Elements elements = Header(layout);
    for (const uint32_t i : which) {
      elements.bytes.append(
          layout.bytes.substr(i * layout.stride, layout.component_bytes * static_cast<size_t>(components)));
      elements.bytes.resize((elements.bytes.size() + 3) / 4 * 4);
    }
    layout.normalized = false;
    std::vector<double> raw(which.size() * static_cast<size_t>(components));
    for (size_t k = 0; k < which.size(); ++k) Decode(layout, which[k], &raw[k * static_cast<size_t>(components)]);
    SetBounds(raw, static_cast<size_t>(components), elements.header);
    return elements;
  }

  bool HoldsIndices() const { return IsUnsigned(accessor_.componentType) && !accessor_.normalized; }

 private:
  static bool IsUnsigned(int type) {
    return type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ||
           type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
  }

  // 0 for a type that glTF 2.0 does not have.
  static size_t ComponentBytes(int type) {
    switch (type) {
      case TINYGLTF_COMPONENT_TYPE_BYTE:
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return 1;
      case TINYGLTF_COMPONENT_TYPE_SHORT:
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return 2;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return 4;
      default:
        return 0;
    }
  }

  absl::Status CheckType(int components) const {
    const int has = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor_.type));
    const bool matrix = accessor_.type == TINYGLTF_TYPE_MAT2;
    if (matrix || has != components)
      return Error(absl::StrCat("has ", has, " components, ", components, " are needed"));
    if (ComponentBytes(accessor_.componentType) == 0) {
      return Error(absl::StrCat("component type ", accessor_.componentType, " does not exist"));
    }
    return accessor_.count > 0 ? absl::OkStatus() : Error("has no elements");
  }

  absl::Status CheckUnbacked() const {
    if (accessor_.count <= kMaxUnbackedElements) return absl::OkStatus();
    return Error(absl::StrCat(accessor_.count, " elements without a buffer view, at most ", kMaxUnbackedElements));
  }

  absl::StatusOr<Layout> Main(int components) const {
    Layout layout{{}, 0, 0, components, accessor_.componentType, accessor_.normalized};
    return Locate(layout, accessor_.bufferView, accessor_.byteOffset, accessor_.count);
  }

  Elements Header(const Layout& layout) const {
    Elements elements;
    const size_t element_bytes = layout.component_bytes * static_cast<size_t>(layout.components);
    elements.stride_bytes = (element_bytes + 3) / 4 * 4;
    elements.padded = elements.stride_bytes != element_bytes;
    const auto& type = source_.document.json["accessors"][static_cast<size_t>(index_)]["type"];
    elements.header = {{"componentType", layout.component_type}, {"type", type}};
    if (layout.normalized) elements.header["normalized"] = true;
    return elements;
  }

  absl::StatusOr<Elements> GatherFloats(std::span<const uint32_t> which, int components) const {
    BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> values, Read(components));
    const auto width = static_cast<size_t>(components);
    Elements elements = Header({{}, 0, sizeof(float), components, TINYGLTF_COMPONENT_TYPE_FLOAT, false});
    std::vector<double> chosen;
    for (const uint32_t i : which) {
      for (size_t c = 0; c < width; ++c) {
        chosen.push_back(values[i * width + c]);
        const auto value = static_cast<float>(chosen.back());
        elements.bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
      }
    }
    SetBounds(chosen, width, elements.header);
    return elements;
  }

  // min and max over the elements, where they are numbers (JSON has no others).
  static void SetBounds(const std::vector<double>& values, size_t width, nlohmann::json& header) {
    if (!std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) return;
    for (size_t i = 0; i < values.size(); ++i) {
      nlohmann::json& low = header["min"][i % width];
      nlohmann::json& high = header["max"][i % width];
      low = i < width ? values[i] : std::min(low.get<double>(), values[i]);
      high = i < width ? values[i] : std::max(high.get<double>(), values[i]);
    }
  }

  // Fills in bytes and stride, or says that `count` elements do not fit. All sums stay far below 2^64: sizes are below
  // 2^53 (schema.h) and strides at most 252.
  absl::StatusOr<Layout> Locate(Layout layout, int view, uint64_t offset, uint64_t count) const {
    BAKEWELL_ASSIGN_OR_RETURN(const std::string_view bytes, ViewBytes(source_.document, view));
    layout.component_bytes = ComponentBytes(layout.component_type);
    const size_t element_bytes = layout.component_bytes * static_cast<size_t>(layout.components);
    const size_t stride = source_.model.bufferViews[static_cast<size_t>(view)].byteStride;
    layout.stride = stride == 0 ? element_bytes : stride;
    if (layout.stride < element_bytes) return Error(absl::StrCat("its stride ", stride, " is less than an element"));
    const bool fits = offset <= bytes.size() && element_bytes <= bytes.size() - offset &&
                      count - 1 <= (bytes.size() - offset - element_bytes) / layout.stride;
    if (!fits) {
      return Error(absl::StrCat(count, " elements at offset ", offset, " with stride ", layout.stride, " leave its ",
                                bytes.size(), "-byte buffer view"));
    }
    layout.bytes = bytes.substr(offset);
    return layout;
  }

  template <typename T>
  static double Component(const char* at, bool normalized) {
    T value;
    std::memcpy(&value, at, sizeof(T));
    if (!std::is_integral_v<T> || !normalized) return static_cast<double>(value);
    return std::max(static_cast<double>(value) / static_cast<double>(std::numeric_limits<T>::max()), -1.0);
  }

  static double Number(const Layout& layout, const char* at) {
    switch (layout.component_type) {
      case TINYGLTF_COMPONENT_TYPE_BYTE:
        return Component<int8_t>(at, layout.normalized);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return Component<uint8_t>(at, layout.normalized);
      case TINYGLTF_COMPONENT_TYPE_SHORT:
        return Component<int16_t>(at, layout.normalized);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return Component<uint16_t>(at, layout.normalized);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return Component<uint32_t>(at, layout.normalized);
      default:
        return Component<float>(at, false);
    }
  }

  static void Decode(const Layout& layout, size_t element, double* values) {
    const char* at = layout.bytes.data() + element * layout.stride;
    for (int c = 0; c < layout.components; ++c) {
      values[c] = Number(layout, at + static_cast<size_t>(c) * layout.component_bytes);
    }
  }

  absl::Status ApplySparse(int components, std::vector<double>& values) const {
    const auto& sparse = accessor_.sparse;
    if (sparse.count < 1 || static_cast<size_t>(sparse.count) > accessor_.count) {
      return Error(absl::StrCat(sparse.count, " sparse elements in ", accessor_.count));
    }
    if (!IsUnsigned(sparse.indices.componentType)) return Error("its sparse indices are not unsigned");
    const auto count = static_cast<uint64_t>(sparse.count);
    const Layout index_layout{{}, 0, 0, 1, sparse.indices.componentType, false};
    BAKEWELL_ASSIGN_OR_RETURN(const Layout indices, Locate(index_layout, sparse.indices.bufferView,
                                                           static_cast<uint64_t>(sparse.indices.byteOffset), count));
    const Layout value_layout{{}, 0, 0, components, accessor_.componentType, accessor_.normalized};
    BAKEWELL_ASSIGN_OR_RETURN(
        const Layout replacements,
        Locate(value_layout, sparse.values.bufferView, static_cast<uint64_t>(sparse.values.byteOffset), count));
    return Replace(indices, replacements, values);
  }

  absl::Status Replace(const Layout& indices, const Layout& replacements, std::vector<double>& values) const {
    for (size_t i = 0; i < static_cast<size_t>(accessor_.sparse.count); ++i) {
      double index = 0;
      Decode(indices, i, &index);
      if (index >= static_cast<double>(accessor_.count)) {
        return Error(absl::StrCat("sparse index ", index, " is beyond its ", accessor_.count, " elements"));
      }
      Decode(replacements, i, &values[static_cast<size_t>(index) * static_cast<size_t>(replacements.components)]);
    }
    return absl::OkStatus();
  }

  const Source& source_;
  int index_;
  const tinygltf::Accessor& accessor_;
};

}  // namespace

absl::StatusOr<std::vector<double>> ReadNumbers(const Source& source, int accessor, int components) {
  return AccessorReader(source, accessor).Read(components);
}

absl::StatusOr<std::vector<uint32_t>> ReadIndices(const Source& source, int accessor, uint64_t vertices) {
  const AccessorReader reader(source, accessor);
  if (!reader.HoldsIndices()) return reader.Error("indices are not unsigned integers");
  BAKEWELL_ASSIGN_OR_RETURN(const std::vector<double> values, reader.Read(1));
  std::vector<uint32_t> indices(values.size());
  for (size_t i = 0; i < values.size(); ++i) {
    if (values[i] >= static_cast<double>(vertices)) {
      return reader.Error(absl::StrCat("index ", values[i], " at place ", i, " is beyond the ", vertices, " vertices"));
    }
    indices[i] = static_cast<uint32_t>(values[i]);
  }
  return indices;
}

absl::StatusOr<Elements> GatherElements(const Source& source, int accessor, std::span<const uint32_t> which) {
  return AccessorReader(source, accessor).Gather(which);
}

}  // namespace bakewell::gltf
