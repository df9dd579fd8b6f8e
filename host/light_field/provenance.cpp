// SPDX-License-Identifier: Apache-2.0
#include "host/light_field/provenance.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfIntAttribute.h>
#include <ImfOutputFile.h>
#include <ImfStringAttribute.h>
#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/atomic_file.h"
#include "common/error.h"
#include "host/light_field/ray_answer.h"

namespace mf {

std::size_t Provenance::block_at(const PlaneRectangle& plane, int resolution, std::size_t direction,
                                 const Eigen::Vector2f& p) const {
  const Eigen::Vector2d relative = (p.cast<double>() - plane.min_m).cwiseQuotient(plane.size_m());
  const auto index = [&](double share) {
    return std::clamp(static_cast<int>(share * resolution) / block_texels, 0, side - 1);
  };
  return block(direction, index(relative.x()), index(1 - relative.y()));
}

Provenance trace_provenance(const std::vector<FieldView>& views, const LightField& field,
                            const ProxyVisibility& visibility, const EmitterBlender& emitters,
                            const PenaltyOptions& penalty, std::vector<std::string> frame_names) {
  Provenance out;
  out.side = (field.resolution + Provenance::block_texels - 1) / Provenance::block_texels;
  out.k = penalty.k;
  out.frames = std::move(frame_names);
  const std::size_t blocks = field.directions.size() * static_cast<std::size_t>(out.side * out.side);
  out.shares.resize(blocks * static_cast<std::size_t>(out.k));
  out.emitter.resize(blocks);
  const float texel_m = static_cast<float>(field.plane.size_m().maxCoeff()) / static_cast<float>(field.resolution);
  const Eigen::Matrix3f turn = field.plane.world_from_plane.rotation.toRotationMatrix().cast<float>();
  tbb::parallel_for(std::size_t{0}, field.directions.size(), [&](std::size_t i) {
    for (int y = 0; y < out.side; ++y)
      for (int x = 0; x < out.side; ++x) {
        const auto middle = [&](int block) {
          const int first = block * Provenance::block_texels;
          return 0.5 * (first + std::min(first + Provenance::block_texels, field.resolution)) / field.resolution;
        };
        const Eigen::Vector2d size = field.plane.size_m();
        const Eigen::Vector3d p(field.plane.min_m.x() + middle(x) * size.x(),
                                field.plane.max_m.y() - middle(y) * size.y(), 0);
        const WantedRay ray{(field.plane.world_from_plane * p).cast<float>(), turn * field.directions.directions[i],
                            field.surroundings.is_plane() ? texel_m : std::sqrt(field.directions.solid_angles_sr[i])};
        const std::size_t block = out.block(i, x, y);
        const RayAnswer answer = answer_of(views, field.surroundings, ray, {penalty, &visibility, &emitters, {}});
        for (std::size_t rank = 0; rank < answer.speaking.size(); ++rank)
          out.shares[block * static_cast<std::size_t>(out.k) + rank] = {
              static_cast<std::uint32_t>(views[answer.speaking[rank].view].frame), answer.speaking[rank].weight};
        out.emitter[block] = emitters.concerned(ray.p, ray.direction, ray.angle_rad);
      }
  });
  return out;
}

namespace {

// One channel a rank for the frames and one for the weights, and the emitter; the layout of the shares in memory.
Imf::FrameBuffer frame_buffer_of(Provenance& p, int width) {
  Imf::FrameBuffer buffer;
  const std::size_t block = static_cast<std::size_t>(p.k) * sizeof(Provenance::Share);
  for (int rank = 0; rank < p.k; ++rank) {
    Provenance::Share& first = p.shares[static_cast<std::size_t>(rank)];
    buffer.insert(fmt::format("frame{:02}", rank), Imf::Slice(Imf::UINT, reinterpret_cast<char*>(&first.frame), block,
                                                              block * static_cast<std::size_t>(width)));
    buffer.insert(fmt::format("weight{:02}", rank), Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(&first.weight),
                                                               block, block * static_cast<std::size_t>(width)));
  }
  buffer.insert("emitter", Imf::Slice(Imf::UINT, reinterpret_cast<char*>(p.emitter.data()), sizeof(std::uint32_t),
                                      sizeof(std::uint32_t) * static_cast<std::size_t>(width)));
  return buffer;
}

}  // namespace

void write_provenance(const std::filesystem::path& path, const Provenance& provenance) {
  AtomicFile file(path);
  try {
    Provenance copy = provenance;  // OpenEXR writes from the type that it reads into
    const int width = copy.side * copy.side;
    const auto height = static_cast<int>(copy.emitter.size()) / width;
    Imf::Header header(width, height);
    for (int rank = 0; rank < copy.k; ++rank) {
      header.channels().insert(fmt::format("frame{:02}", rank), Imf::Channel(Imf::UINT));
      header.channels().insert(fmt::format("weight{:02}", rank), Imf::Channel(Imf::FLOAT));
    }
    header.channels().insert("emitter", Imf::Channel(Imf::UINT));
    header.compression() = Imf::ZIP_COMPRESSION;
    header.insert("mfProvenanceSide", Imf::IntAttribute(copy.side));
    header.insert("mfProvenanceViews", Imf::IntAttribute(copy.k));
    header.insert("mfFrames", Imf::StringAttribute(nlohmann::json(copy.frames).dump()));
    Imf::OutputFile out(file.path().c_str(), header);
    out.setFrameBuffer(frame_buffer_of(copy, width));
    out.writePixels(height);
  } catch (const std::exception& e) {
    throw InputError(
        path.string(), "",
        fmt::format("cannot be written ({}): check the folder, its permissions and the free space", e.what()));
  }
  file.commit();
}

Provenance read_provenance(const std::filesystem::path& path) {
  try {
    Imf::InputFile in(path.c_str());
    const auto integer = [&](const char* name) {
      const auto* found = in.header().findTypedAttribute<Imf::IntAttribute>(name);
      if (found == nullptr || found->value() < 1 || found->value() > 64)
        throw InputError(path.string(), name,
                         "is missing: this was not written by 'mirrorfield resample --provenance'");
      return found->value();
    };
    Provenance p;
    p.side = integer("mfProvenanceSide");
    p.k = integer("mfProvenanceViews");
    const auto* frames = in.header().findTypedAttribute<Imf::StringAttribute>("mfFrames");
    if (frames == nullptr) throw InputError(path.string(), "mfFrames", "is missing: resample again");
    p.frames = nlohmann::json::parse(frames->value()).get<std::vector<std::string>>();
    const Imath::Box2i box = in.header().dataWindow();
    const int width = box.max.x - box.min.x + 1, height = box.max.y - box.min.y + 1;
    if (width != p.side * p.side) throw InputError(path.string(), "dataWindow", "does not fit mfProvenanceSide");
    p.emitter.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    p.shares.resize(p.emitter.size() * static_cast<std::size_t>(p.k));
    in.setFrameBuffer(frame_buffer_of(p, width));
    in.readPixels(box.min.y, box.max.y);
    for (const Provenance::Share& share : p.shares)
      if (share.frame != Provenance::nobody && share.frame >= p.frames.size())
        throw InputError(path.string(), "frame00", "names a frame that mfFrames does not have: resample again");
    return p;
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& e) {
    throw InputError(path.string(), "", fmt::format("is no readable provenance ({}): resample again", e.what()));
  }
}

}  // namespace mf
