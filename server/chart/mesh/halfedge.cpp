#include "server/chart/mesh/halfedge.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <mutex>

#include "core/base/check.h"

namespace bakewell::chart {
namespace {

struct Traits : OpenMesh::DefaultTraits {
  VertexAttributes(OpenMesh::Attributes::None);
  FaceAttributes(OpenMesh::Attributes::None);
  HalfedgeAttributes(OpenMesh::Attributes::None);
  EdgeAttributes(OpenMesh::Attributes::None);
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using Corners = std::array<OpenMesh::VertexHandle, 3>;

// OpenMesh reports what it cannot add on its own stream; here that is an ordinary case.
void SilenceOpenMesh() {
  static std::once_flag once;
  std::call_once(once, [] { omerr().disable(); });
}

class Builder {
 public:
  explicit Builder(uint32_t vertex_count, size_t face_count) {
    mesh_.reserve(vertex_count, 3 * face_count / 2 + 3, face_count);
    for (uint32_t v = 0; v < vertex_count; ++v) AddVertex(v);
  }

  void AddFace(const std::array<uint32_t, 3>& triangle) {
    Corners corners;
    for (int k = 0; k < 3; ++k) corners[k] = mesh_.vertex_handle(triangle[k]);
    SplitWhatIsTaken(corners);
    if (mesh_.add_face(corners[0], corners[1], corners[2]).is_valid()) return;
    // The patches around a shared vertex cannot be linked: the triangle stands alone.
    for (auto& corner : corners) corner = AddVertex(origin_[corner.idx()]);
    BAKEWELL_CHECK(mesh_.add_face(corners[0], corners[1], corners[2]).is_valid());
  }

  HalfEdgeResult Finish() && {
    HalfEdgeResult result;
    result.face.resize(mesh_.n_faces());
    result.across.resize(mesh_.n_faces());
    for (uint32_t f = 0; f < result.face.size(); ++f) ReadFace(f, result);
    result.origin = std::move(origin_);
    return result;
  }

 private:
  OpenMesh::VertexHandle AddVertex(uint32_t origin) {
    origin_.push_back(origin);
    return mesh_.add_vertex(Mesh::Point(0, 0, 0));
  }

  // A vertex inside a closed fan, and both ends of an edge that already has this side, are replaced by copies.
  void SplitWhatIsTaken(Corners& corners) {
    std::array<bool, 3> split{};
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      if (!mesh_.is_boundary(corners[k])) split[k] = true;
      const OpenMesh::HalfedgeHandle edge = mesh_.find_halfedge(corners[k], corners[next]);
      if (edge.is_valid() && !mesh_.is_boundary(edge)) split[k] = split[next] = true;
    }
    for (int k = 0; k < 3; ++k)
      if (split[k]) corners[k] = AddVertex(origin_[corners[k].idx()]);
  }

  void ReadFace(uint32_t f, HalfEdgeResult& result) const {
    // The handle's first half-edge ends in the first corner, so begin one later.
    OpenMesh::HalfedgeHandle edge = mesh_.next_halfedge_handle(mesh_.halfedge_handle(mesh_.face_handle(f)));
    for (int k = 0; k < 3; ++k, edge = mesh_.next_halfedge_handle(edge)) {
      const OpenMesh::FaceHandle other = mesh_.opposite_face_handle(edge);
      result.face[f][k] = static_cast<uint32_t>(mesh_.from_vertex_handle(edge).idx());
      result.across[f][k] = other.is_valid() ? static_cast<uint32_t>(other.idx()) : UINT32_MAX;
    }
  }

  Mesh mesh_;
  std::vector<uint32_t> origin_;
};

}  // namespace

HalfEdgeResult BuildHalfEdges(std::span<const std::array<uint32_t, 3>> triangle, uint32_t vertex_count) {
  SilenceOpenMesh();
  Builder builder(vertex_count, triangle.size());
  for (const auto& corners : triangle) builder.AddFace(corners);
  return std::move(builder).Finish();
}

}  // namespace bakewell::chart
