// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <unistd.h>

#include <fstream>

#include "common/error.h"
#include "host/render/gbuffer.h"
#include "tests/host/render/scenes.h"

namespace mf {
namespace {

class SceneInput : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::filesystem::path file = folder_ / name;
    std::ofstream(file, std::ios::binary) << text;
    return file;
  }
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("mf_scene_input_" + std::to_string(getpid()) + "_" +
                                                testing::UnitTest::GetInstance()->current_test_info()->name());
};

// The message of the InputError that `f` throws; empty when it throws none.
template <typename F>
std::string problem(const F& f) {
  try {
    f();
  } catch (const InputError& e) {
    return e.what();
  }
  return {};
}

TEST_F(SceneInput, ObjKeepsItsCoordinatesAndNormals) {
  const auto file = write("a.obj", "v 0 0 1\nv 1 0 1\nv 0 1 1.5\nvn 0 0 2\nf 1//1 2//1 3//1\n");
  const TriangleMesh mesh = read_mesh(file);
  ASSERT_EQ(mesh.triangles.size(), 1U);
  EXPECT_TRUE(mesh.positions[mesh.triangles[0][2]].isApprox(Eigen::Vector3f(0, 1, 1.5F)));
  EXPECT_TRUE(mesh.normals[0].isApprox(Eigen::Vector3f::UnitZ()));
  EXPECT_FLOAT_EQ(mesh.albedo[0].x(), default_albedo);
  EXPECT_FLOAT_EQ(read_mesh(file, {0.25}).albedo[0].y(), 0.25F);
}

TEST_F(SceneInput, WithoutNormalsIsFlat) {
  const auto file = write("roof.obj", "v 0 0 0\nv 0 1 0\nv 1 0 1\nv -1 0 1\nf 1 3 2\nf 1 2 4\n");
  const TriangleMesh mesh = read_mesh(file);
  ASSERT_EQ(mesh.triangles.size(), 2U);
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3f e1 = mesh.positions[t[1]] - mesh.positions[t[0]];
    const Eigen::Vector3f face = e1.cross(mesh.positions[t[2]] - mesh.positions[t[0]]).normalized();
    for (const auto v : t) EXPECT_TRUE(mesh.normals[v].isApprox(face, 1e-5F));
  }
}

TEST_F(SceneInput, MaterialsGiveTheirBaseColour) {
  write("m.mtl", "newmtl red\nKd 0.8 0.1 0.05\n");
  const auto file = write("m.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n");
  EXPECT_TRUE(read_mesh(file).albedo[0].isApprox(Eigen::Vector3f(0.8F, 0.1F, 0.05F), 1e-5F));
}

// glTF 2.0 is Y-up and right-handed; one triangle (1,2,3) (4,2,3) (1,5,3) under a node that lifts it by 10.
TEST_F(SceneInput, GltfIsTurnedZUp) {
  const std::string base64 = "AACAPwAAAEAAAEBAAACAQAAAAEAAAEBAAACAPwAAoEAAAEBA";
  const auto file = write("t.gltf", R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)"
                                    R"("nodes":[{"mesh":0,"translation":[0,10,0]}],)"
                                    R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],)"
                                    R"("materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1]}}],)"
                                    R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
                                    R"("min":[1,2,3],"max":[4,5,3]}],)"
                                    R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"byteLength":36,)"
                                    R"("uri":"data:application/octet-stream;base64,)" +
                                        base64 + R"("}]})");
  const TriangleMesh mesh = read_mesh(file);
  ASSERT_EQ(mesh.triangles.size(), 1U);
  EXPECT_TRUE(mesh.positions[mesh.triangles[0][0]].isApprox(Eigen::Vector3f(1, -3, 12)));
  EXPECT_TRUE(mesh.positions[mesh.triangles[0][1]].isApprox(Eigen::Vector3f(4, -3, 12)));
  EXPECT_TRUE(mesh.normals[0].isApprox(-Eigen::Vector3f::UnitY()));  // glTF +z faces −y
  EXPECT_TRUE(mesh.albedo[0].isApprox(Eigen::Vector3f(0.5F, 0.25F, 0.125F), 1e-5F));
}

TEST_F(SceneInput, BadMeshesAreNamed) {
  const auto none = folder_ / "none.obj";
  EXPECT_NE(problem([&] { (void)read_mesh(none); }).find("none.obj: is missing"), std::string::npos);
  const auto empty = write("empty.obj", "# nothing\n");
  EXPECT_NE(problem([&] { (void)read_mesh(empty); }).find("empty.obj"), std::string::npos);
  const auto points = write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
  EXPECT_NE(problem([&] { (void)read_mesh(points); }).find("points.obj: holds no triangle"), std::string::npos);
  for (const char* face : {"1 2 9", "1 2 -9", "0 1 2"}) {
    const auto beyond = write("beyond.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nf ") + face + "\n");
    EXPECT_NE(problem([&] { (void)read_mesh(beyond); }).find("export it again"), std::string::npos) << face;
  }
  const auto flat = write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
  EXPECT_NE(problem([&] { (void)read_mesh(flat); }).find("holds no triangle"), std::string::npos);
  const auto nan = write("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_NE(problem([&] { (void)read_mesh(nan); }).find("nan.obj"), std::string::npos);
  const auto noise = write("noise.glb", "glTF but not really");
  EXPECT_NE(problem([&] { (void)read_mesh(noise); }).find("noise.glb"), std::string::npos);
  EXPECT_TRUE(MeshOptions{1.5}.validate());
  EXPECT_TRUE(MeshOptions{std::nan("")}.validate());
}

const std::string pose = R"("camera_from_world":[[1,0,0,0],[0,-1,0,0],[0,0,-1,2],[0,0,0,1]])";
const std::string k_matrix = R"("K":[[100,0,32],[0,100,24],[0,0,1]])";

TEST_F(SceneInput, ViewsAreRead) {
  const auto file = write("v.json", "[{" + pose + "," + k_matrix + "}]");
  const View view = read_view(file, 0);
  EXPECT_EQ(view.camera.width, 64);
  EXPECT_EQ(view.camera.height, 48);
  EXPECT_EQ(read_view(file, 0, std::array<int, 2>{50, 40}).camera.width, 50);
  EXPECT_TRUE((view.cam_from_world * Eigen::Vector3d(0, 0, 0.5)).isApprox(Eigen::Vector3d(0, 0, 1.5)));
}

TEST_F(SceneInput, BadViewsAreNamed) {
  const auto read = [&](const std::string& json, int index, std::optional<std::array<int, 2>> size = {}) {
    const auto file = write("v.json", json);
    return problem([&] { (void)read_view(file, index, size); });
  };
  const std::string good = "[{" + pose + "," + k_matrix + "}]";
  EXPECT_EQ(read(good, 0), "");
  EXPECT_NE(read(good, 1).find("has no view 1"), std::string::npos);
  EXPECT_NE(read(good, -1).find("has no view -1"), std::string::npos);
  EXPECT_NE(read("[{" + pose + "}]", 0).find("[0].K: is missing"), std::string::npos);
  EXPECT_NE(read("[{" + k_matrix + "}]", 0).find("[0].camera_from_world: is missing"), std::string::npos);
  EXPECT_NE(read("[{" + pose + R"(,"K":[[100,0],[0,100]]}])", 0).find('K'), std::string::npos);
  EXPECT_NE(read("[{" + pose + R"(,"K":[[-1,0,32],[0,100,24],[0,0,1]]}])", 0).find("focal"), std::string::npos);
  EXPECT_NE(read("[{" + pose + R"(,"K":"no"}])", 0).find('K'), std::string::npos);
  EXPECT_NE(read("[3]", 0).find("v.json"), std::string::npos);
  EXPECT_NE(read("{}", 0).find("is no list of views"), std::string::npos);
  EXPECT_NE(read("[{", 0).find("is no valid JSON"), std::string::npos);
  // A plate of half the size: the principal point gives it away.
  EXPECT_NE(read(good, 0, std::array<int, 2>{32, 24}).find("principal point"), std::string::npos);
}

// A sphere at distance d covers the pixels within asin(r/d) of its centre.
TEST(GBuffer, CoversASphereExactlyAndShadesItOnceAPixel) {
  const TriangleMesh mesh = test::sphere({0, 0, 0.5F}, 0.3F, 96);
  const RayScene scene(mesh);
  CameraModel camera;
  camera.width = 200, camera.height = 160;
  camera.parameters = {150, 150, 100, 80, 0, 0, 0, 0, 0};
  const Rigid3 cam_from_plane{Eigen::Quaterniond(0, 1, 0, 0), {0, 0, 2}};  // looks down from z = 2
  const GBuffer g = make_gbuffer(mesh, scene, camera, cam_from_plane);
  double area = 0;
  for (const Fragment& f : g.fragments) area += f.coverage;
  const double radius_px = 150 * std::tan(std::asin(0.3 / 1.5));
  EXPECT_NEAR(area, test::pi * radius_px * radius_px, 0.003 * area);
  EXPECT_LT(static_cast<double>(g.fragments.size()), 1.2 * area + 4 * radius_px);
  for (const SurfacePoint& p : g.points) {
    EXPECT_NEAR((p.position - Eigen::Vector3f(0, 0, 0.5F)).norm(), 0.3, 1e-3);
    EXPECT_GT(p.normal.dot((p.position - Eigen::Vector3f(0, 0, 0.5F)).normalized()), 0.999);
    EXPECT_GT(p.geometric_normal.dot(p.normal), 0.98);
  }
  // The rest is ground, and each of its points projects back to its pixel's centre.
  EXPECT_GT(static_cast<double>(g.ground_points.size()), 200 * 160 - area - 1);
  for (std::size_t i = 0; i < g.ground_points.size(); i += 997) {
    const Eigen::Vector2d pixel = camera.project(cam_from_plane * g.ground_points[i].position.cast<double>());
    EXPECT_NEAR(pixel.x(), g.ground_pixels[i] % 200 + 0.5, 1e-3);
    EXPECT_NEAR(pixel.y(), static_cast<int>(g.ground_pixels[i] / 200) + 0.5, 1e-3);
  }
}

TEST(GBuffer, HasNoGroundAboveTheHorizon) {
  CameraModel camera;
  camera.width = 64, camera.height = 64;
  camera.parameters = {64, 64, 32, 32, 0, 0, 0, 0, 0};
  // At 1 m, looking along +y, level: camera x = plane x, camera y = −plane z, camera z = plane y.
  Eigen::Matrix3d rotation;
  rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Rigid3 cam_from_plane{Eigen::Quaterniond(rotation), rotation * Eigen::Vector3d(0, 0, -1)};
  const GBuffer g = make_gbuffer({}, RayScene(TriangleMesh{}), camera, cam_from_plane);
  EXPECT_TRUE(g.fragments.empty());
  EXPECT_EQ(g.ground_pixels.size(), 64U * 32U);
  for (const std::uint32_t pixel : g.ground_pixels) EXPECT_GE(pixel / 64, 32U);
}

}  // namespace
}  // namespace mf
