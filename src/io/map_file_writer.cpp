#include <algorithm>
#include <ostream>
#include <stdexcept>

#include "byte_stream.h"
#include "io/atomic_file.h"
#include "map_file_format.h"
#include "mono_pose_tracker/io/map_file.h"

namespace mono_pose_tracker {

namespace {

constexpr std::uint32_t kVersion = 2;

void write_transform(const Rigid3& b_from_a, ByteWriter* out) {
  for (int i = 0; i < 4; ++i) out->f64(b_from_a.rotation.coeffs()[i]);
  for (int i = 0; i < 3; ++i) out->f64(b_from_a.translation[i]);
}

void write_camera(const CameraParameters& camera, ByteWriter* out) {
  out->u32(static_cast<std::uint32_t>(camera.width));
  out->u32(static_cast<std::uint32_t>(camera.height));
  for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy}) out->f64(value);
  out->text(camera.distortion_model);
  // Without a model they are zeros, of any number.
  const auto coefficients =
      static_cast<std::uint32_t>(camera.distortion_model.empty() ? 0 : camera.distortion.size());
  out->u32(coefficients);
  for (std::uint32_t i = 0; i < coefficients; ++i) out->f64(camera.distortion[i]);
}

ByteWriter head_of(const SavedMaps& saved) {
  ByteWriter out;
  out.text(saved.descriptor);
  std::vector<CameraParameters> cameras;
  std::vector<std::uint32_t> camera_of_session;
  for (const MapSession& session : saved.sessions) {
    const auto known = std::find(cameras.begin(), cameras.end(), session.camera);
    camera_of_session.push_back(static_cast<std::uint32_t>(known - cameras.begin()));
    if (known == cameras.end()) cameras.push_back(session.camera);
  }
  out.u32(static_cast<std::uint32_t>(cameras.size()));
  for (const CameraParameters& camera : cameras) write_camera(camera, &out);
  out.u32(static_cast<std::uint32_t>(saved.sessions.size()));
  for (std::size_t i = 0; i < saved.sessions.size(); ++i) {
    out.u32(camera_of_session[i]);
    out.i64(saved.sessions[i].first_frame);
    out.i64(saved.sessions[i].frames);
  }
  out.u32(static_cast<std::uint32_t>(saved.maps.size()));
  for (const Map& map : saved.maps) out.u32(static_cast<std::uint32_t>(map.scale_source()));
  return out;
}

void write_keyframe(const Keyframe& keyframe, ByteWriter* out) {
  out->i32(keyframe.id);
  out->i64(keyframe.frame_index);
  out->i64(keyframe.stamp_ns);
  write_transform(keyframe.camera_from_map, out);
  const ImageFeatures& image = *keyframe.image;
  out->u32(static_cast<std::uint32_t>(image.size()));
  for (int i = 0; i < image.size(); ++i) {
    const Feature& f = image.set.features[i];
    for (const float value : {f.pixel.x(), f.pixel.y(), f.scale, f.angle, f.response}) out->f32(value);
    for (int c = 0; c < 3; ++c) out->u8(image.color_rgb[i][c]);
    out->raw(image.set.descriptor(i), kMapFileDescriptorBytes);
  }
}

ByteWriter keyframes_of(const Map& map) {
  ByteWriter out;
  out.u32(static_cast<std::uint32_t>(map.keyframes().size()));
  for (const auto& entry : map.keyframes()) write_keyframe(entry.second, &out);
  return out;
}

ByteWriter removed_keyframes_of(const Map& map) {
  ByteWriter out;
  out.u32(static_cast<std::uint32_t>(map.removed_keyframes().size()));
  for (const auto& [id, link] : map.removed_keyframes()) {
    out.i32(id);
    out.i64(link.frame_index);
    out.i32(link.parent);
    write_transform(link.removed_from_parent, &out);
  }
  return out;
}

ByteWriter landmarks_of(const Map& map) {
  ByteWriter out;
  out.u32(static_cast<std::uint32_t>(map.landmarks().size()));
  for (const LandmarkId id : map.landmark_ids()) {
    const Landmark& landmark = *map.landmark(id);
    out.i32(landmark.id);
    for (int i = 0; i < 3; ++i) out.f64(landmark.x_in_map[i]);
    out.i32(landmark.created_by);
    out.u32(static_cast<std::uint32_t>(landmark.observations.size()));
    for (const Observation& o : landmark.observations) {
      out.i32(o.keyframe);
      out.i32(o.feature);
    }
  }
  return out;
}

void write_section(const char* name, const ByteWriter& payload, std::ostream& stream) {
  ByteWriter head;
  head.raw(name, 4);
  head.u64(payload.bytes().size());
  ByteWriter crc;
  crc.u32(map_file_crc(head.bytes(), payload.bytes()));
  stream << head.bytes() << crc.bytes() << payload.bytes();
}

void check_sessions(const SavedMaps& saved) {
  const auto check = [&](std::int64_t frame_index) {
    if (std::none_of(saved.sessions.begin(), saved.sessions.end(),
                     [&](const MapSession& session) { return session.holds(frame_index); })) {
      throw std::invalid_argument("frame " + std::to_string(frame_index) + " of a map belongs to no session");
    }
  };
  for (const Map& map : saved.maps) {
    for (const auto& entry : map.keyframes()) check(entry.second.frame_index);
    for (const auto& entry : map.removed_keyframes()) check(entry.second.frame_index);
  }
}

}  // namespace

void write_map_file(const std::string& path, const SavedMaps& saved) {
  if (saved.maps.empty()) throw std::invalid_argument("there is no map to write");
  check_sessions(saved);
  require_regular_file(path);
  write_file_atomically(path, [&](std::ostream& stream) {
    ByteWriter start;
    start.raw(kMapFileMagic.data(), kMapFileMagic.size());
    start.u32(kVersion);
    start.u32(1 + kMapFileSectionsOfMap * static_cast<std::uint32_t>(saved.maps.size()));
    stream << start.bytes();
    write_section("HEAD", head_of(saved), stream);
    for (const Map& map : saved.maps) {
      write_section("KEYF", keyframes_of(map), stream);
      write_section("REMV", removed_keyframes_of(map), stream);
      write_section("LAND", landmarks_of(map), stream);
    }
  });
}

}  // namespace mono_pose_tracker
