#pragma once

#include <filesystem>

#include "client/gltf/file/model.h"

namespace bakewell::gltf {

// A document beside its typed view: what readers are given.
struct Source {
  Document document;
  tinygltf::Model model;
};

// ReadDocument and ToModel in one, with their errors.
absl::StatusOr<Source> ReadSource(const std::filesystem::path& path);

}  // namespace bakewell::gltf
