#include "server/chart/obj.h"

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/IO/reader/OBJReader.hh>
#include <cstdio>
#include <fstream>

namespace bakewell::chart {
namespace {

using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;

// Takes what OpenMesh's reader finds as a soup: OpenMesh's own meshes would refuse non-manifold faces.
class SoupImporter : public OpenMesh::IO::BaseImporter {
 public:
  ObjMesh mesh;
  bool bad_index = false;

  VertexHandle add_vertex(const OpenMesh::Vec3f& p) override {
    mesh.position.push_back({p[0], p[1], p[2]});
    return VertexHandle(static_cast<int>(mesh.position.size()) - 1);
  }
  VertexHandle add_vertex() override { return add_vertex(OpenMesh::Vec3f(0, 0, 0)); }
  FaceHandle add_face(const VHandles& corners) override {
    for (const VertexHandle v : corners)
      if (v.idx() < 0 || v.idx() >= static_cast<int>(mesh.position.size())) bad_index = true;
    if (bad_index) return FaceHandle();
    for (size_t k = 2; k < corners.size(); ++k)
      for (const size_t c : {size_t{0}, k - 1, k}) mesh.index.push_back(static_cast<uint32_t>(corners[c].idx()));
    return FaceHandle(static_cast<int>(mesh.index.size() / 3) - 1);
  }
  size_t n_vertices() const override { return mesh.position.size(); }
  size_t n_faces() const override { return mesh.index.size() / 3; }
  size_t n_edges() const override { return 0; }

  // Everything else in the file is of no use here.
  HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
  FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec2f>&) override {}
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<OpenMesh::Vec3f>&) override {}
  void set_face_texindex(FaceHandle, int) override {}
  void set_point(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_halfedge(VertexHandle, HalfedgeHandle) override {}
  void set_normal(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(VertexHandle, const OpenMesh::Vec3d&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_color(VertexHandle, const OpenMesh::Vec4f&) override {}
  void set_texcoord(VertexHandle, const OpenMesh::Vec2f&) override {}
  void set_status(VertexHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_next(HalfedgeHandle, HalfedgeHandle) override {}
  void set_face(HalfedgeHandle, FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec2f&) override {}
  void set_texcoord(VertexHandle, const OpenMesh::Vec3f&) override {}
  void set_texcoord(HalfedgeHandle, const OpenMesh::Vec3f&) override {}
  void set_status(HalfedgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec3f&) override {}
  void set_color(OpenMesh::EdgeHandle, const OpenMesh::Vec4f&) override {}
  void set_status(OpenMesh::EdgeHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void set_normal(FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_normal(FaceHandle, const OpenMesh::Vec3d&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec3uc&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec4uc&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec3f&) override {}
  void set_color(FaceHandle, const OpenMesh::Vec4f&) override {}
  void set_status(FaceHandle, const OpenMesh::Attributes::StatusInfo&) override {}
  void add_texture_information(int, std::string) override {}
};

template <typename... Args>
void Append(std::string& text, const char* format, Args... args) {
  char line[128];
  text.append(line, static_cast<size_t>(std::snprintf(line, sizeof line, format, args...)));
}

void AppendFace(std::string& text, const ObjMesh& mesh, const Mesh& atlas_mesh, uint32_t triangle) {
  text += 'f';
  for (uint32_t k = 0; k < 3; ++k)
    Append(text, " %u/%u", mesh.index[3 * triangle + k] + 1, atlas_mesh.indexArray[3 * triangle + k] + 1);
  text += '\n';
}

}  // namespace

absl::StatusOr<ObjMesh> ReadObj(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return absl::NotFoundError(path.string() + ": cannot be opened");
  SoupImporter importer;
  OpenMesh::IO::Options options;
  if (!OpenMesh::IO::OBJReader().read(file, importer, options) || importer.mesh.index.empty())
    return absl::InvalidArgumentError(path.string() + ": not an OBJ file with faces");
  if (importer.bad_index)
    return absl::InvalidArgumentError(path.string() + ": a face names a vertex that is not there");
  return std::move(importer.mesh);
}

std::string FormatObj(const ObjMesh& mesh, const Atlas& atlas) {
  const Mesh& charted = atlas.meshes[0];
  std::string text;
  Append(text, "# atlas %u %u\n", atlas.width, atlas.height);
  for (const Vec3f& p : mesh.position) Append(text, "v %.9g %.9g %.9g\n", p.x, p.y, p.z);
  for (const Vertex& v : charted.vertexArray)
    Append(text, "vt %.17g %.17g\n", v.uv[0] / double(std::max(atlas.width, 1u)),
           v.uv[1] / double(std::max(atlas.height, 1u)));
  for (size_t c = 0; c < charted.chartArray.size(); ++c) {
    Append(text, "g chart_%zu\n", c + 1000000 * size_t{charted.chartArray[c].atlasIndex});
    for (const uint32_t triangle : charted.chartArray[c].faceArray) AppendFace(text, mesh, charted, triangle);
  }
  text += "g none_1\n";
  for (uint32_t t = 0; t < charted.faceState.size(); ++t)
    if (charted.faceState[t] != FaceState::kCharted) AppendFace(text, mesh, charted, t);
  return text;
}

}  // namespace bakewell::chart
