// From heights to triangles, beside OpenSubdiv's uniform refinement of the same control mesh in the
// same run: 5 000 faces to level 4, 640 000 vertices. Items are vertices of the finest level.
#include <benchmark/benchmark.h>
#include <opensubdiv/far/primvarRefiner.h>
#include <opensubdiv/far/topologyDescriptor.h>

#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "core/codec/container/dss.h"
#include "core/codec/mesh/prepare_control_mesh.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {
namespace {

namespace Far = OpenSubdiv::OPENSUBDIV_VERSION::Far;
namespace Sdc = OpenSubdiv::OPENSUBDIV_VERSION::Sdc;

constexpr int kLevel = 4;

// A bumpy torus of 5 000 faces in the unit frame; every ninth quad has its diagonal turned, so that
// valences run from 4 to 8.
ControlMesh BumpyTorus() {
  constexpr int kAround = 100, kAcross = 25;
  ControlMesh mesh;
  mesh.vertices.resize(3, kAround * kAcross);
  mesh.faces.resize(3, 2 * kAround * kAcross);
  for (int i = 0; i < kAround; ++i) {
    for (int j = 0; j < kAcross; ++j) {
      const double u = 2 * std::numbers::pi * i / kAround, v = 2 * std::numbers::pi * j / kAcross;
      const double tube = 0.1 + 0.01 * std::sin(5 * u) * std::cos(3 * v);
      const double radius = 0.3 + tube * std::cos(v);
      const int a = i * kAcross + j, b = (i + 1) % kAround * kAcross + j;
      const int d = i * kAcross + (j + 1) % kAcross;
      const int c = (i + 1) % kAround * kAcross + (j + 1) % kAcross;
      mesh.vertices.col(a) << radius * std::cos(u), radius * std::sin(u), tube * std::sin(v);
      const bool turned = a % 9 == 0;
      mesh.faces.col(2 * a) << a, b, turned ? d : c;
      mesh.faces.col(2 * a + 1) << (turned ? b : a), c, d;
    }
  }
  return mesh;
}

DisplacedSurface DisplacedExample() {
  DisplacedSurface surface;
  surface.control_mesh = *PrepareControlMesh(BumpyTorus(), kPositionStep);
  surface.max_level = kLevel;
  const size_t count = (surface.control_mesh.faces.cols() / 2) << (2 * kLevel);
  surface.heights.resize(count);
  uint32_t random = 1;
  for (float& height : surface.heights) {
    random = random * 1664525u + 1013904223u;
    height = 1e-4f * (static_cast<float>(random) * 0x1p-31f - 1.0f);
  }
  surface.sources.assign(count, HeightSource::kMeasured);
  return surface;
}

RunContext Threads(int threads) {
  RunContext context;
  context.threads = threads;
  return context;
}

struct Value {
  float x = 0, y = 0, z = 0;
  void Clear() { x = y = z = 0; }
  void AddWithWeight(const Value& other, float weight) {
    x += weight * other.x, y += weight * other.y, z += weight * other.z;
  }
};

std::unique_ptr<Far::TopologyRefiner> RefineUniformly(const ControlMesh& mesh) {
  const std::vector<int> vertices_per_face(static_cast<size_t>(mesh.faces.cols()), 3);
  Far::TopologyDescriptor descriptor;
  descriptor.numVertices = static_cast<int>(mesh.vertices.cols());
  descriptor.numFaces = static_cast<int>(mesh.faces.cols());
  descriptor.numVertsPerFace = vertices_per_face.data();
  descriptor.vertIndicesPerFace = mesh.faces.data();
  Sdc::Options options;
  options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
  using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
  std::unique_ptr<Far::TopologyRefiner> refiner(
      Factory::Create(descriptor, Factory::Options(Sdc::SCHEME_LOOP, options)));
  Far::TopologyRefiner::UniformOptions uniform(kLevel);
  uniform.fullTopologyInLastLevel = true;
  refiner->RefineUniform(uniform);
  return refiner;
}

void OpenSubdivTopology(benchmark::State& state) {
  const ControlMesh mesh = DisplacedExample().control_mesh;
  int64_t vertices = 0;
  for (auto _ : state) vertices += RefineUniformly(mesh)->GetLevel(kLevel).GetNumVertices();
  state.SetItemsProcessed(vertices);
}
BENCHMARK(OpenSubdivTopology)->UseRealTime()->Unit(benchmark::kMillisecond);

// Limit positions and normals in single precision, no displacement.
void OpenSubdivLimit(benchmark::State& state) {
  const ControlMesh mesh = DisplacedExample().control_mesh;
  const auto refiner = RefineUniformly(mesh);
  const size_t count = static_cast<size_t>(refiner->GetLevel(kLevel).GetNumVertices());
  std::vector<Value> position(count), u(count), v(count), normal(count);
  for (auto _ : state) {
    std::vector<Value> values(static_cast<size_t>(mesh.vertices.cols()));
    for (size_t i = 0; i < values.size(); ++i) {
      const Eigen::Vector3f p = mesh.vertices.col(static_cast<Eigen::Index>(i)).cast<float>();
      values[i] = {p.x(), p.y(), p.z()};
    }
    const Far::PrimvarRefinerReal<float> primvars(*refiner);
    for (int level = 1; level <= kLevel; ++level) {
      std::vector<Value> fine(static_cast<size_t>(refiner->GetLevel(level).GetNumVertices()));
      primvars.Interpolate(level, values, fine);
      values = std::move(fine);
    }
    primvars.Limit(values, position, u, v);
    for (size_t i = 0; i < count; ++i) {
      const Eigen::Vector3f n = Eigen::Vector3f(u[i].x, u[i].y, u[i].z)
                                    .cross(Eigen::Vector3f(v[i].x, v[i].y, v[i].z))
                                    .normalized();
      normal[i] = {n.x(), n.y(), n.z()};
    }
    benchmark::DoNotOptimize(normal.data());
  }
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(count));
}
BENCHMARK(OpenSubdivLimit)->UseRealTime()->Unit(benchmark::kMillisecond);

// Displaced vertices, triangles, normals of the displaced triangles. Argument: threads.
void TessellateSurface(benchmark::State& state) {
  const DisplacedSurface surface = DisplacedExample();
  const RunContext context = Threads(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(Tessellate(surface, kLevel, context));
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(surface.heights.size()));
}
BENCHMARK(TessellateSurface)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

// Bytes to heights: entropy decoding and wavelets. Argument: RMS error, in millionths of the
// diagonal; the heights are noise of 58.
void DecodeHeights(benchmark::State& state) {
  const DisplacedSurface surface = DisplacedExample();
  EncodeOptions options;
  options.max_error = 1e-6 * static_cast<double>(state.range(0));
  const std::vector<uint8_t> bytes = EncodeDss(surface, {}, options, RunContext())->Concatenate();
  for (auto _ : state) benchmark::DoNotOptimize(DecodeDss(bytes, Threads(2)));
  state.counters["bytes"] = static_cast<double>(bytes.size());
  state.SetItemsProcessed(state.iterations() * static_cast<int64_t>(surface.heights.size()));
}
BENCHMARK(DecodeHeights)->Arg(20)->Arg(1000)->UseRealTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace rilievo
