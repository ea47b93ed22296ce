#include "tests/stress/odd_requests.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/strings/str_split.h"
#include "google/protobuf/message.h"
#include "server/conversion/job_request.h"

namespace rilievo::stress {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

class Draw {
 public:
  explicit Draw(uint64_t seed) : engine_(seed) {}

  int Below(int count) { return static_cast<int>(engine_() % static_cast<uint64_t>(count)); }
  bool Chance(double share) { return Unit() < share; }
  double Unit() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double Normal() { return std::normal_distribution<double>()(engine_); }
  uint64_t Bits() { return engine_(); }
  template <typename T, size_t N>
  T Of(const std::array<T, N>& values) {
    return values[static_cast<size_t>(Below(static_cast<int>(N)))];
  }

 private:
  std::mt19937_64 engine_;
};

double OddNumber(Draw& draw) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (draw.Chance(0.5)) return std::pow(10, 3 - 15 * draw.Unit());
  return draw.Of<double, 18>({0, -0.0, 5e-324, 1e-300, 1e-9, 1e-6, 0.01, 0.05, 0.1, 0.2, 0.5,
                              std::nextafter(1.0, 0.0), 1, 1.5, 1000, -1, kInfinity,
                              std::numeric_limits<double>::quiet_NaN()});
}

uint64_t OddCount(Draw& draw, uint64_t most) {
  constexpr std::array<uint64_t, 16> kCounts = {0,  1,  2,  3,   4,    5,      6,       8,
                                                20, 50, 64, 200, 5000, 60'000, 200'000, 1'000'000};
  return std::min(most, draw.Chance(0.9) ? draw.Of(kCounts) : draw.Bits() >> draw.Below(64));
}

void SetOddly(Message* message, const FieldDescriptor* field, Draw& draw) {
  const auto* access = message->GetReflection();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return access->SetDouble(message, field, OddNumber(draw));
    case FieldDescriptor::CPPTYPE_UINT32:
      return access->SetUInt32(message, field, static_cast<uint32_t>(OddCount(draw, UINT32_MAX)));
    case FieldDescriptor::CPPTYPE_UINT64:
      return access->SetUInt64(message, field, OddCount(draw, UINT64_MAX));
    case FieldDescriptor::CPPTYPE_BOOL:
      return access->SetBool(message, field, draw.Chance(0.5));
    case FieldDescriptor::CPPTYPE_ENUM:  // one that does not exist too
      return access->SetEnumValue(message, field,
                                  draw.Below(field->enum_type()->value_count() + 1));
    default:
      return;  // a control mesh: MakeOddMesh
  }
}

// `share`: of the fields that are set.
void FillOddly(Message* message, double share, Draw& draw) {
  const auto* type = message->GetDescriptor();
  for (int i = 0; i < type->field_count(); ++i) {
    const FieldDescriptor* field = type->field(i);
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && !field->is_repeated()) {
      if (field->message_type() == v1::ControlMesh::descriptor()) continue;
      FillOddly(message->GetReflection()->MutableMessage(message, field), share, draw);
    } else if (draw.Chance(share)) {
      SetOddly(message, field, draw);
    }
  }
}

void AddVertex(double x, double y, double z, v1::ControlMesh* mesh) {
  const std::array<double, 3> vertex = {x, y, z};
  mesh->mutable_positions()->append(reinterpret_cast<const char*>(vertex.data()), sizeof(vertex));
}

void AddFace(int a, int b, int c, v1::ControlMesh* mesh) {
  for (const int v : {a, b, c}) mesh->add_faces(static_cast<uint32_t>(v));
}

// An octahedron or a part of it, a sheet, a fan with a vertex of any valence, or nonsense.
void MakeOddMesh(Draw& draw, v1::ControlMesh* mesh) {
  const double size = draw.Chance(0.3) ? std::pow(10, 12 * draw.Unit() - 6) : 1;
  const int kind = draw.Below(4);
  if (kind == 0) {
    const int cells = draw.Of<int, 5>({1, 2, 20, 60, 150});
    for (int i = 0; i <= cells; ++i) {
      for (int j = 0; j <= cells; ++j) {
        AddVertex(size * (2.0 * j / cells - 1), size * (2.0 * i / cells - 1), 0.1 * draw.Unit(),
                  mesh);
      }
    }
    for (int i = 0; i < cells; ++i) {
      for (int j = 0; j < cells; ++j) {
        const int a = i * (cells + 1) + j, b = a + cells + 1;
        AddFace(a, a + 1, b + 1, mesh);
        AddFace(a, b + 1, b, mesh);
      }
    }
    return;
  }
  const int around = kind == 1 ? draw.Of<int, 4>({3, 60, 70, 5000}) : 4;
  AddVertex(0, 0, size, mesh);
  AddVertex(0, 0, -size, mesh);
  for (int i = 0; i < around; ++i) {
    const double angle = 2 * std::numbers::pi * i / around;
    AddVertex(size * std::cos(angle), size * std::sin(angle), 0, mesh);
  }
  const int faces = kind == 2 ? 1 + draw.Below(2 * around) : 2 * around;
  for (int f = 0; f < faces; ++f) {
    const int a = 2 + f / 2, b = 2 + (f / 2 + 1) % around;
    if (kind == 3 && draw.Chance(0.3)) {
      AddFace(draw.Below(around + 3), draw.Below(around), draw.Below(around), mesh);
    } else if (f % 2 == 0) {
      AddFace(0, a, b, mesh);
    } else {
      AddFace(1, b, a, mesh);
    }
  }
}

std::array<double, 3> OddPoint(int kind, int number, Draw& draw) {
  const double u = draw.Unit(), v = draw.Unit(), w = draw.Unit();
  switch (kind) {
    case 0:
      return {draw.Normal(), draw.Normal(), draw.Normal()};
    case 1:
      return {u, v, 0.05 * std::sin(9 * u)};
    case 2: {  // a torus
      const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v;
      return {(1 + 0.4 * std::cos(b)) * std::cos(a), (1 + 0.4 * std::cos(b)) * std::sin(a),
              0.4 * std::sin(b)};
    }
    case 3:
      return {5e6 + 1e6 * u, 4e6 + 1e6 * v, w};
    case 4:
      return {1e12 * u, 1e-12 * v, w};
    case 5:
      return {u, 0, 0};
    case 6:
      return {draw.Of<double, 4>({0, 1e300, -1e300, 1e-300}), 1e300 * v, 1e300 * w};
    case 7:
      return {draw.Chance(0.3) ? std::numeric_limits<double>::quiet_NaN() : u, v,
              draw.Chance(0.1) ? std::numeric_limits<double>::infinity() : w};
    case 8:
      return {std::floor(5 * u), std::floor(5 * v), std::floor(5 * w)};
    case 9:
      return {(1 + number % 7) * std::cos(60 * u), (1 + number % 7) * std::sin(60 * u), 60 * u};
    default: {  // a box
      std::array<double, 3> point = {u, v, w};
      point[static_cast<size_t>(draw.Below(3))] = draw.Below(2);
      return point;
    }
  }
}

std::string OddPoints(int count, bool as_double, Draw& draw) {
  const int kind = draw.Below(11);
  std::string bytes;
  const auto append = [&](auto value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  for (int i = 0; i < count; ++i) {
    for (const double x : OddPoint(kind, i, draw)) {
      if (as_double) {
        append(x);
      } else {
        append(static_cast<float>(x));
      }
    }
  }
  return bytes;
}

// Makes it a mesh: a part of a shape or nonsense, some with the vertices somewhere else.
void MakeMesh(Draw& draw, OddRequest* request) {
  v1::ControlMesh mesh;
  MakeOddMesh(draw, &mesh);
  const auto vertices = static_cast<int>(mesh.positions().size() / 24);
  request->header.set_coordinate_format(v1::COORDINATE_FORMAT_FLOAT64_LE);
  request->header.set_point_count(static_cast<uint64_t>(vertices));
  request->header.set_triangle_count(static_cast<uint64_t>(mesh.faces_size() / 3));
  request->points = draw.Chance(0.3) ? OddPoints(vertices, true, draw) : mesh.positions();
  request->triangles.assign(reinterpret_cast<const char*>(mesh.faces().data()),
                            sizeof(uint32_t) * static_cast<size_t>(mesh.faces_size()));
}

// Takes out what `path` names, a field of the header's.
void ClearField(std::string_view path, Message* header) {
  const std::vector<std::string> names =
      absl::StrSplit(absl::string_view(path.data(), path.size()), '.');
  Message* message = header;
  for (size_t i = 1; i < names.size(); ++i) {  // after "header"
    const FieldDescriptor* field = message->GetDescriptor()->FindFieldByName(names[i]);
    if (field == nullptr) return;
    const bool is_mesh = field->message_type() == v1::ControlMesh::descriptor();
    if (i + 1 == names.size() || is_mesh)
      return message->GetReflection()->ClearField(message, field);
    message = message->GetReflection()->MutableMessage(message, field);
  }
}

void ClearWhatIsRefused(v1::ReconstructHeader* header) {
  for (int round = 0; round < 50; ++round) {
    const auto parsed = ParseHeader(*header, {});
    const auto* error = std::get_if<CallError>(&parsed);
    if (error == nullptr) return;
    for (const FieldViolation& violation : error->violations) ClearField(violation.field, header);
  }
}

}  // namespace

OddRequest DrawOddRequest(uint64_t seed, uint64_t number) {
  Draw draw(seed * 0x9e3779b97f4a7c15u + number);
  OddRequest request;
  const bool as_double = draw.Chance(0.7);
  request.header.set_coordinate_format(as_double ? v1::COORDINATE_FORMAT_FLOAT64_LE
                                                 : v1::COORDINATE_FORMAT_FLOAT32_LE);
  const int count = draw.Of<int, 7>({20, 21, 50, 300, 2000, 6000, 20'000});
  request.header.set_point_count(static_cast<uint64_t>(count));
  v1::ReconstructOptions* options = request.header.mutable_options();
  FillOddly(options, draw.Of<double, 4>({0.1, 0.3, 0.5, 0.8}), draw);
  if (draw.Chance(0.25)) {
    options->mutable_control()->clear_topology();
    MakeOddMesh(draw, options->mutable_control()->mutable_control_mesh());
  }
  const bool cleared = draw.Chance(0.97);
  Draw of_mesh(~(seed * 0x9e3779b97f4a7c15u + number));  // scans stay as they were drawn
  if (of_mesh.Chance(0.2)) {
    MakeMesh(of_mesh, &request);
  } else {
    request.points = OddPoints(count, as_double, draw);
  }
  if (cleared) ClearWhatIsRefused(&request.header);
  return request;
}

}  // namespace rilievo::stress
