// SPDX-License-Identifier: Apache-2.0
#include "host/io/mesh.h"

#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/Importer.hpp>
#include <cmath>

#include "common/atomic_file.h"
#include "common/error.h"

namespace mf {

namespace {

Eigen::Vector3f to_eigen(const aiVector3D& v) {
  return {v.x, v.y, v.z};
}

// The file's base colour, or nothing when it names no material (assimp then makes up a grey "DefaultMaterial").
std::optional<Eigen::Vector3f> base_colour(const aiMaterial& material) {
  if (material.GetName() == aiString(AI_DEFAULT_MATERIAL_NAME)) return std::nullopt;
  aiColor4D colour;
  if (material.Get(AI_MATKEY_BASE_COLOR, colour) != AI_SUCCESS &&
      material.Get(AI_MATKEY_COLOR_DIFFUSE, colour) != AI_SUCCESS)
    return std::nullopt;
  const Eigen::Vector3f rgb(colour.r, colour.g, colour.b);
  return rgb.allFinite() ? std::optional(Eigen::Vector3f(rgb.cwiseMax(0.F).cwiseMin(1.F))) : std::nullopt;
}

void append(TriangleMesh& mesh, const aiMesh& part, const Eigen::Vector3f& albedo, const std::string& file) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (unsigned i = 0; i < part.mNumVertices; ++i) {
    const Eigen::Vector3f position = to_eigen(part.mVertices[i]);
    if (!position.allFinite())
      throw InputError(file, "vertex " + std::to_string(first + i), "is not finite: repair the mesh");
    const Eigen::Vector3f normal = part.HasNormals() ? to_eigen(part.mNormals[i]) : Eigen::Vector3f::Zero();
    mesh.positions.push_back(position);
    mesh.normals.push_back(normal.allFinite() ? normal : Eigen::Vector3f::Zero());
    mesh.albedo.push_back(albedo);
  }
  for (unsigned i = 0; i < part.mNumFaces; ++i) {
    const aiFace& face = part.mFaces[i];
    if (face.mNumIndices != 3) continue;  // points and lines have no surface
    mesh.triangles.push_back({first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]});
  }
}

// What Assimp says, in words for someone who did not write it.
std::string why_unread(const std::string& complaint) {
  if (complaint.starts_with("No output meshes")) return "holds no triangle: export the mesh with its faces";
  return "is no mesh that can be read, or is cut off (" + complaint.substr(0, complaint.find_last_not_of(" .\n") + 1) +
         "): export it again";
}

bool is_gltf(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  return extension == ".gltf" || extension == ".glb" || extension == ".GLTF" || extension == ".GLB";
}

void turn_z_up(TriangleMesh& mesh) {
  const auto turn = [](Eigen::Vector3f& v) { v = Eigen::Vector3f(v.x(), -v.z(), v.y()); };
  for (Eigen::Vector3f& v : mesh.positions) turn(v);
  for (Eigen::Vector3f& v : mesh.normals) turn(v);
}

Eigen::Vector3f face_normal(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Eigen::Vector3f& a = mesh.positions[triangle[0]];
  return (mesh.positions[triangle[1]] - a).cross(mesh.positions[triangle[2]] - a);
}

// Unit normals; a vertex whose file normal is unusable gets its triangle's. Triangles without area are dropped: they
// catch no light and have no normal.
void repair(TriangleMesh& mesh) {
  std::erase_if(mesh.triangles, [&](const auto& t) { return !(face_normal(mesh, t).squaredNorm() > 0); });
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t v : triangle)
      if (!(mesh.normals[v].squaredNorm() > 0)) mesh.normals[v] = face_normal(mesh, triangle);
  for (Eigen::Vector3f& n : mesh.normals)
    n = n.squaredNorm() > 0 ? n.normalized() : Eigen::Vector3f::UnitZ();  // a vertex of no triangle
}

}  // namespace

std::optional<std::string> MeshOptions::validate() const {
  if (albedo && !(*albedo >= 0 && *albedo <= 1)) return "albedo must lie between 0 and 1";
  return std::nullopt;
}

TriangleMesh read_mesh(const std::filesystem::path& path, const MeshOptions& options) {
  const std::string file = path.string();
  if (!std::filesystem::is_regular_file(path)) throw InputError(file, "", "is missing: name an OBJ or glTF file");
  Assimp::Importer importer;
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  const aiScene* scene =
      importer.ReadFile(file, aiProcess_Triangulate | aiProcess_PreTransformVertices | aiProcess_GenNormals |
                                  aiProcess_JoinIdenticalVertices | aiProcess_SortByPType);
  if (scene == nullptr || scene->mNumMeshes == 0) throw InputError(file, "", why_unread(importer.GetErrorString()));
  TriangleMesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    const aiMesh& part = *scene->mMeshes[i];
    Eigen::Vector3f albedo =
        base_colour(*scene->mMaterials[part.mMaterialIndex]).value_or(Eigen::Vector3f::Constant(default_albedo));
    if (options.albedo) albedo.setConstant(static_cast<float>(*options.albedo));
    append(mesh, part, albedo, file);
  }
  if (is_gltf(path)) turn_z_up(mesh);
  repair(mesh);
  if (mesh.triangles.empty()) throw InputError(file, "", "holds no triangle: export the mesh with its faces");
  return mesh;
}

void write_obj(const std::filesystem::path& path, const TriangleMesh& mesh) {
  std::string text;
  for (const Eigen::Vector3f& p : mesh.positions) text += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  for (const Eigen::Vector3f& n : mesh.normals) text += fmt::format("vn {} {} {}\n", n.x(), n.y(), n.z());
  for (const auto& [a, b, c] : mesh.triangles)
    text += fmt::format("f {0}//{0} {1}//{1} {2}//{2}\n", a + 1, b + 1, c + 1);
  write_file_atomically(path, text);
}

TriangleMesh transformed(const Rigid3& target_from_source, TriangleMesh mesh) {
  const Eigen::Matrix3f rotation = target_from_source.rotation.toRotationMatrix().cast<float>();
  for (Eigen::Vector3f& p : mesh.positions) p = (target_from_source * p.cast<double>().eval()).cast<float>();
  for (Eigen::Vector3f& n : mesh.normals) n = rotation * n;
  return mesh;
}

Bounds bounds_of(const TriangleMesh& mesh) {
  if (mesh.positions.empty()) return {};
  Bounds bounds;
  bounds.low = bounds.high = mesh.positions.front();
  for (const Eigen::Vector3f& p : mesh.positions) {
    bounds.low = bounds.low.cwiseMin(p);
    bounds.high = bounds.high.cwiseMax(p);
  }
  bounds.centre = (bounds.low + bounds.high) / 2;
  for (const Eigen::Vector3f& p : mesh.positions) bounds.radius = std::max(bounds.radius, (p - bounds.centre).norm());
  return bounds;
}

std::array<Eigen::Vector3f, 8> corners_of(const Bounds& box) {
  std::array<Eigen::Vector3f, 8> corners;
  for (unsigned i = 0; i < corners.size(); ++i)
    corners[i] = {(i & 1U) != 0 ? box.high.x() : box.low.x(), (i & 2U) != 0 ? box.high.y() : box.low.y(),
                  (i & 4U) != 0 ? box.high.z() : box.low.z()};
  return corners;
}

}  // namespace mf
