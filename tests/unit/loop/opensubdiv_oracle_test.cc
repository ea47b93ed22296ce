#include "tests/unit/loop/opensubdiv_oracle.h"

#include <gtest/gtest.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <Eigen/Geometry>
#include <memory>
#include <numeric>

#include "tests/unit/geometry/test_meshes.h"

namespace rilievo::testing {
namespace {

namespace Far = OpenSubdiv::OPENSUBDIV_VERSION::Far;
namespace Sdc = OpenSubdiv::OPENSUBDIV_VERSION::Sdc;

struct Value {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  void Clear() { value.setZero(); }
  void AddWithWeight(const Value& other, double weight) { value += weight * other.value; }
};

std::unique_ptr<Far::TopologyRefiner> RefineUniformly(const ControlMesh& mesh,
                                                      const LoopRefinement& refinement,
                                                      int max_level) {
  std::vector<int> corners(mesh.faces.data(), mesh.faces.data() + mesh.faces.size());
  if (mesh.quads()) {
    corners = CornersOfQuads(refinement.levels.front(), refinement.quads.levels.front());
  }
  const size_t sides = mesh.quads() ? 4 : 3;
  const std::vector<int> vertices_per_face(corners.size() / sides, static_cast<int>(sides));
  Far::TopologyDescriptor descriptor;
  descriptor.numVertices = static_cast<int>(mesh.vertices.cols());
  descriptor.numFaces = static_cast<int>(vertices_per_face.size());
  descriptor.numVertsPerFace = vertices_per_face.data();
  descriptor.vertIndicesPerFace = corners.data();
  std::vector<int> crease_ends;
  std::vector<float> crease_sharpness;
  for (const Crease& crease : mesh.creases) {
    crease_ends.insert(crease_ends.end(), {crease.a, crease.b});
    crease_sharpness.push_back(crease.sharpness);
  }
  descriptor.numCreases = static_cast<int>(crease_sharpness.size());
  descriptor.creaseVertexIndexPairs = crease_ends.data();
  descriptor.creaseWeights = crease_sharpness.data();
  const std::vector<float> corner_sharpness(mesh.corners.size(), kInfiniteSharpness);
  descriptor.numCorners = static_cast<int>(mesh.corners.size());
  descriptor.cornerVertexIndices = mesh.corners.data();
  descriptor.cornerWeights = corner_sharpness.data();
  Sdc::Options options;
  options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  std::unique_ptr<Far::TopologyRefiner> refiner(Factory::Create(
      descriptor,
      Factory::Options(mesh.quads() ? Sdc::SCHEME_CATMARK : Sdc::SCHEME_LOOP, options)));
  Far::TopologyRefiner::UniformOptions uniform(max_level);
  uniform.fullTopologyInLastLevel = true;
  refiner->RefineUniform(uniform);
  return refiner;
}

// The face that two corners have in common.
int FaceOf(const Far::TopologyLevel& level, int a, int b) {
  const Far::ConstIndexArray of_a = level.GetVertexFaces(a), of_b = level.GetVertexFaces(b);
  for (int i = 0; i < of_a.size(); ++i) {
    if (of_b.FindIndex(of_a[i]) >= 0) return of_a[i];
  }
  return -1;
}

// numbers[v]: OpenSubdiv's number of vertex v of `level`.
std::vector<int> OpenSubdivNumbers(const Far::TopologyRefiner& refiner,
                                   const LoopRefinement& refinement, int level) {
  std::vector<int> numbers(static_cast<size_t>(refinement.levels[0].vertex_count));
  std::iota(numbers.begin(), numbers.end(), 0);
  for (int l = 0; l < level; ++l) {
    const Far::TopologyLevel& theirs = refiner.GetLevel(l);
    const Eigen::Matrix2Xi& edges = refinement.levels[static_cast<size_t>(l)].edge_vertices;
    std::vector<int> fine;
    for (int number : numbers) fine.push_back(theirs.GetVertexChildVertex(number));
    for (Eigen::Index e = 0; e < edges.cols(); ++e) {
      const int a = numbers[static_cast<size_t>(edges(0, e))];
      const int b = numbers[static_cast<size_t>(edges(1, e))];
      const int edge = theirs.FindEdge(a, b);
      fine.push_back(edge >= 0 ? theirs.GetEdgeChildVertex(edge)
                               : theirs.GetFaceChildVertex(FaceOf(theirs, a, b)));
    }
    numbers = std::move(fine);
  }
  return numbers;
}

OracleLevel LimitOfLastLevel(const Far::TopologyRefiner& refiner, const std::vector<Value>& values,
                             const std::vector<int>& numbers) {
  std::vector<Value> position(values.size()), first(values.size()), second(values.size());
  Far::PrimvarRefinerReal<double>(refiner).Limit(values, position, first, second);
  OracleLevel result;
  const Eigen::Index count = static_cast<Eigen::Index>(values.size());
  result.positions.resize(3, count);
  result.limit_positions.resize(3, count);
  result.limit_normals.resize(3, count);
  result.limit_tangents.resize(6, count);
  for (Eigen::Index v = 0; v < count; ++v) {
    const size_t i = static_cast<size_t>(numbers[static_cast<size_t>(v)]);
    result.limit_tangents.col(v) << first[i].value, second[i].value;
    result.positions.col(v) = values[i].value;
    result.limit_positions.col(v) = position[i].value;
    result.limit_normals.col(v) = first[i].value.cross(second[i].value).normalized();
  }
  return result;
}

}  // namespace

std::vector<OracleLevel> EvaluateWithOpenSubdiv(const ControlMesh& mesh,
                                                const LoopRefinement& refinement) {
  std::vector<OracleLevel> levels;
  // PrimvarRefiner takes limits at the last level only, hence one refiner a level.
  for (int last = 0; last <= refinement.max_level(); ++last) {
    const std::unique_ptr<Far::TopologyRefiner> refiner = RefineUniformly(mesh, refinement, last);
    std::vector<Value> values(static_cast<size_t>(mesh.vertices.cols()));
    for (size_t v = 0; v < values.size(); ++v) {
      values[v].value = mesh.vertices.col(static_cast<Eigen::Index>(v));
    }
    const Far::PrimvarRefinerReal<double> primvars(*refiner);
    for (int level = 1; level <= last; ++level) {
      std::vector<Value> fine(static_cast<size_t>(refiner->GetLevel(level).GetNumVertices()));
      primvars.Interpolate(level, values, fine);
      values = std::move(fine);
    }
    levels.push_back(
        LimitOfLastLevel(*refiner, values, OpenSubdivNumbers(*refiner, refinement, last)));
  }
  return levels;
}

namespace {

TEST(OpenSubdivOracleTest, IsNumberedLikeTheRefinement) {
  const ControlMesh mesh = Grid(4, 4);
  const auto refinement = RefineTopology(mesh, 2, RunContext());
  ASSERT_TRUE(refinement.ok()) << refinement.status();
  const auto levels = EvaluateWithOpenSubdiv(mesh, *refinement);
  ASSERT_EQ(levels.size(), 3u);
  ASSERT_EQ(levels[2].positions.cols(), 169);
  // Inside, a regular flat grid with linear parameters keeps its points.
  EXPECT_LT((levels[2].positions.col(5) - mesh.vertices.col(5)).norm(), 1e-15);
  EXPECT_LT((levels[2].limit_positions.col(5) - mesh.vertices.col(5)).norm(), 1e-15);
  EXPECT_LT((levels[2].limit_normals.colwise() - Eigen::Vector3d::UnitZ()).cwiseAbs().maxCoeff(),
            1e-12);
}

}  // namespace
}  // namespace rilievo::testing
