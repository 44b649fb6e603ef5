// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/mesh_reader.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <assimp/Importer.hpp>
#include <assimp/scene.h>

#include "understory/sim/ply_check.hpp"

namespace understory {
namespace {

constexpr float kLargestCoordinateM = 1e5F;

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw ForestError(path + ": " + reason);
}

// The importer also recognises files by their content and would read formats nobody has tested.
void check_format(const std::string& path) {
  std::error_code error;
  if (!std::filesystem::exists(path, error)) {
    fail(path, "cannot be opened");
  }
  if (!std::filesystem::is_regular_file(path, error)) {
    fail(path, "is not a file");
  }
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(), [](unsigned char letter) {
    return static_cast<char>(std::tolower(letter));
  });
  if (extension != ".ply" && extension != ".obj" && extension != ".stl") {
    fail(path, "meshes are read from .ply, .obj and .stl files only");
  }
  if (extension == ".ply") {
    std::ifstream file(path, std::ios::binary);
    const std::string defect = ply_defect(
        std::string(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()));
    if (!defect.empty()) {
      fail(path, defect);
    }
  }
}

Eigen::Vector3f to_world(const aiVector3D& vertex, const MeshImport& import) {
  const Eigen::Vector3f in_file(vertex.x, vertex.y, vertex.z);
  const Eigen::Vector3f z_up = import.up_axis == UpAxis::kZ
                                   ? in_file
                                   : Eigen::Vector3f(in_file.x(), -in_file.z(), in_file.y());
  return z_up * static_cast<float>(import.metres_per_unit);
}

void append(const aiMesh& part, const MeshImport& import, TriangleMesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    mesh.vertices_m.push_back(to_world(part.mVertices[i], import));
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    for (unsigned corner = 2; corner < face.mNumIndices; ++corner) {  // none of a point or line
      mesh.triangles.push_back({first + face.mIndices[0],
                                first + face.mIndices[corner - 1],
                                first + face.mIndices[corner]});
    }
  }
}

void check(const TriangleMesh& mesh, const std::string& path) {
  if (mesh.triangles.empty()) {
    fail(path, "holds no triangle");
  }
  for (const Eigen::Vector3f& vertex : mesh.vertices_m) {
    if (!vertex.allFinite()) {
      fail(path, "has a vertex that is not finite");
    }
    if (vertex.cwiseAbs().maxCoeff() > kLargestCoordinateM) {
      fail(path, "has a vertex farther than 100 km from the origin");
    }
  }
  for (const std::array<std::uint32_t, 3>& triangle : mesh.triangles) {
    if (*std::max_element(triangle.begin(), triangle.end()) >= mesh.vertices_m.size()) {
      fail(path, "has a face that names a vertex it does not have");
    }
  }
}

}  // namespace

TriangleMesh read_mesh(const std::string& path, const MeshImport& import) {
  if (!(import.metres_per_unit > 0.0) || !std::isfinite(import.metres_per_unit)) {
    fail(path, "metres_per_unit must be positive");
  }
  check_format(path);
  Assimp::Importer importer;
  // Without post-processing: Assimp's triangulation aborts the process on some broken polygons.
  const aiScene* scene = importer.ReadFile(path, 0);
  if (scene == nullptr) {
    fail(path, std::string("is not a readable mesh: ") + importer.GetErrorString());
  }
  TriangleMesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    append(*scene->mMeshes[i], import, mesh);
  }
  check(mesh, path);
  return mesh;
}

}  // namespace understory
