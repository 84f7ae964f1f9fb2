#include "client/gltf/file/source.h"

namespace bakewell::gltf {

absl::StatusOr<Source> ReadSource(const std::filesystem::path& path) {
  Source source;
  BAKEWELL_ASSIGN_OR_RETURN(source.document, ReadDocument(path));
  BAKEWELL_ASSIGN_OR_RETURN(source.model, ToModel(source.document));
  return source;
}

}  // namespace bakewell::gltf
