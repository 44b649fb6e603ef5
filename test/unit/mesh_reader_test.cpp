// Copyright 2026 the Understory authors
// SPDX-License-Identifier: BSD-3-Clause
#include "understory/sim/mesh_reader.hpp"

#include <array>
#include <cstring>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.hpp"

namespace understory {
namespace {

using testing::HasSubstr;

constexpr const char* kObj =
    "o one\nv 0 0 0\nv 2 0 0\nv 2 0 1\nv 0 0 1\nf 1 2 3 4\n"
    "o two\nv 5 5 5\nv 6 5 5\nv 5 6 5\nf 5 6 7\n";
constexpr const char* kPly =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 0 2\n3 0 1 2\n";
constexpr const char* kStl =
    "solid a\nfacet normal 0 1 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 0 2\n"
    "endloop\nendfacet\nendsolid a\n";

TriangleMesh mesh_of(const std::string& name,
                     const std::string& content,
                     const MeshImport& import = {}) {
  const TemporaryFolder folder;
  return read_mesh(folder.write(name, content), import);
}

std::string error_of(const std::string& name,
                     const std::string& content,
                     const MeshImport& import = {}) {
  try {
    (void)mesh_of(name, content, import);
  } catch (const ForestError& error) {
    return error.what();
  }
  return "no error";
}

Eigen::AlignedBox3f bounds_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& vertex : mesh.vertices_m) {
    bounds.extend(vertex);
  }
  return bounds;
}

TEST(MeshReader, ReadsTheThreeFormats) {
  for (const auto& [name, content] : {std::pair("m.ply", kPly), std::pair("m.STL", kStl)}) {
    const TriangleMesh mesh = mesh_of(name, content);

    ASSERT_EQ(mesh.triangles.size(), 1U) << name;
    EXPECT_EQ(bounds_of(mesh).max(), Eigen::Vector3f(1, 0, 2)) << name;
  }
  const TriangleMesh mesh = mesh_of("m.obj", kObj);
  EXPECT_EQ(mesh.triangles.size(), 3U);  // a quad in two, and the second object
  EXPECT_EQ(bounds_of(mesh).max(), Eigen::Vector3f(6, 6, 5));
}

TEST(MeshReader, ScalesAndTurnsAFileWhoseYIsUp) {
  const TriangleMesh mesh =
      mesh_of("m.obj", "v 1 20 3\nv 2 20 3\nv 1 20 4\nf 1 2 3\n", {0.1, UpAxis::kY});

  const Eigen::AlignedBox3f bounds = bounds_of(mesh);
  EXPECT_TRUE(bounds.min().isApprox(Eigen::Vector3f(0.1F, -0.4F, 2.0F)));
  EXPECT_TRUE(bounds.max().isApprox(Eigen::Vector3f(0.2F, -0.3F, 2.0F)));
}

std::string binary_ply() {
  std::string content =
      "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  for (const float value : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 0.0F, 2.0F}) {
    std::array<char, sizeof value> bytes{};
    std::memcpy(bytes.data(), &value, sizeof value);
    content.append(bytes.data(), bytes.size());
  }
  return content + std::string("\3\0\0\0\0\1\0\0\0\2\0\0\0", 13);
}

TEST(MeshReader, ReadsABinaryFileAndRefusesItCutShortAnywhere) {
  const std::string good = binary_ply();
  EXPECT_EQ(mesh_of("m.ply", good).triangles.size(), 1U);

  for (std::size_t length = 0; length < good.size(); ++length) {
    EXPECT_THAT(error_of("m.ply", good.substr(0, length)), HasSubstr("m.ply")) << length;
  }
}

TEST(MeshReader, RefusesAHeaderThatAnnouncesTooMuch) {
  std::string content = binary_ply();
  content.replace(content.find("vertex 3"), 8, "vertex 4000000000");
  EXPECT_THAT(error_of("m.ply", content), HasSubstr("is cut short"));

  content = kPly;
  content.replace(content.find("face 1"), 6, "face 99");
  EXPECT_THAT(error_of("m.ply", content), HasSubstr("is cut short"));
}

TEST(MeshReader, RefusesWhatIsNoMesh) {
  EXPECT_THAT(error_of("m.obj", ""), HasSubstr("m.obj"));
  EXPECT_THAT(error_of("m.obj", "hello\n"), HasSubstr("m.obj"));
  EXPECT_THAT(error_of("m.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"), HasSubstr("m.obj"));
  EXPECT_THAT(error_of("m.ply", "ply\n"), HasSubstr("m.ply"));
  EXPECT_THAT(error_of("m.stl", "so"), HasSubstr("m.stl"));
  EXPECT_THAT(error_of("m.blend", kObj), HasSubstr(".ply, .obj and .stl"));
  EXPECT_THAT(error_of("mesh", kObj), HasSubstr(".ply, .obj and .stl"));

  const TemporaryFolder folder;
  for (const auto& [name, reason] :
       {std::pair("absent.ply", "cannot be opened"), std::pair("", "is not a file")}) {
    try {
      (void)read_mesh(folder.path_of(name));
      ADD_FAILURE() << "read " << name;
    } catch (const ForestError& error) {
      EXPECT_THAT(error.what(), HasSubstr(reason));
    }
  }
}

TEST(MeshReader, RefusesVerticesThatCannotBe) {
  EXPECT_THAT(error_of("m.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), HasSubstr("not finite"));
  EXPECT_THAT(error_of("m.obj", "v 0 0 1e7\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), HasSubstr("100 km"));
  EXPECT_THAT(error_of("m.obj", kObj, {0.0, UpAxis::kZ}), HasSubstr("metres_per_unit"));
  EXPECT_THAT(error_of("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n"), HasSubstr("m.obj"));
}

TEST(MeshReader, SurvivesEveryTruncation) {
  for (const auto& [name, content] :
       {std::pair("m.obj", kObj), std::pair("m.ply", kPly), std::pair("m.stl", kStl)}) {
    const std::string good = content;
    for (std::size_t length = 0; length < good.size(); ++length) {
      const std::string error = error_of(name, good.substr(0, length));

      EXPECT_TRUE(error == "no error" || error.find(name) != std::string::npos)
          << name << " cut to " << length << ": " << error;
    }
  }
}

}  // namespace
}  // namespace understory
