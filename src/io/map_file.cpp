#include <algorithm>
#include <boost/crc.hpp>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <ostream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "byte_stream.h"
#include "common/time_stamp.h"
#include "io/files.h"
#include "mono_pose_tracker/io/map_file.h"

namespace mono_pose_tracker {

// The line end shows whether a transfer as text mangled the file.
constexpr std::string_view kMapFileMagic("MPTMAP\r\n", 8);
constexpr int kMapFileDescriptorBytes = 128;
constexpr std::uint32_t kMapFileSectionsOfMap = 3;  // KEYF, REMV, LAND

// Of a section: name and size, then the payload.
inline std::uint32_t map_file_crc(std::string_view name_and_size, std::string_view payload) {
  boost::crc_32_type crc;
  crc.process_bytes(name_and_size.data(), name_and_size.size());
  crc.process_bytes(payload.data(), payload.size());
  return crc.checksum();
}

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

namespace {

// Smallest sizes of the records in bytes, to check a count before allocating memory.
enum RecordBytes : std::size_t {
  kTransformBytes = 7 * 8,
  kFeatureBytes = 5 * 4 + 3 + kMapFileDescriptorBytes,
  kKeyframeBytes = 4 + 8 + 8 + kTransformBytes + 4,
  kRemovedBytes = 4 + 8 + 4 + kTransformBytes,
  kObservationBytes = 4 + 4,
  kLandmarkBytes = 4 + 3 * 8 + 4 + 4,
  kCameraBytes = 2 * 4 + 4 * 8 + 4 + 4,
  kSessionBytes = 4 + 8 + 8,
};

// Limits with a margin, because frame indices and ids may be counted on and shifted.
constexpr std::int64_t kMostFrames = std::int64_t{1} << 53;
constexpr int kMostIds = 1 << 29;

// Data with a valid checksum: these errors mean that the file was written wrongly.
[[noreturn]] void contradiction(const std::string& what) {
  throw std::runtime_error("is inconsistent (" + what + ")");
}

double finite(double value) {
  if (!std::isfinite(value)) contradiction("a number is not finite");
  return value;
}

std::int64_t frame_index(ByteReader& in) {
  const std::int64_t value = in.i64();
  if (value < -kMostFrames || value > kMostFrames) contradiction("a frame index is out of range");
  return value;
}

std::int64_t stamp(ByteReader& in) {
  const std::int64_t value = in.i64();
  if (!is_stamp(value)) contradiction("a time stamp is out of range");
  return value;
}

int id(ByteReader& in) {
  const int value = in.i32();
  if (value < 0 || value > kMostIds) contradiction("an id is out of range");
  return value;
}

// Of the keyframe that made a landmark; -1 where it is not known.
int id_or_none(ByteReader& in) {
  const int value = in.i32();
  if (value < -1 || value > kMostIds) contradiction("an id is out of range");
  return value;
}

Rigid3 read_transform(ByteReader& in) {
  Rigid3 b_from_a;
  for (int i = 0; i < 4; ++i) b_from_a.rotation.coeffs()[i] = finite(in.f64());
  for (int i = 0; i < 3; ++i) b_from_a.translation[i] = finite(in.f64());
  if (std::abs(b_from_a.rotation.norm() - 1) > 1e-6) contradiction("a rotation is not a unit quaternion");
  return b_from_a;
}

CameraParameters read_camera(ByteReader& in) {
  CameraParameters camera;
  camera.width = static_cast<int>(in.u32());
  camera.height = static_cast<int>(in.u32());
  for (double* value : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *value = in.f64();
  camera.distortion_model = in.text();
  const std::uint32_t coefficients = in.count(8);
  // OpenCV's longest model has 14.
  if (coefficients > 14) contradiction("too many distortion coefficients");
  camera.distortion.resize(coefficients);
  for (double& value : camera.distortion) value = in.f64();
  return camera;
}

CameraModel model_of(const CameraParameters& camera) {
  try {
    CameraModel model(camera);
    // No camera has more pixels along a side.
    if (std::max(camera.width, camera.height) <= 1 << 16) return model;
  } catch (const std::invalid_argument&) {  // its text may hold what the file does
  }
  contradiction("the camera parameters are invalid");
}

ScaleSource read_scale_source(ByteReader& in) {
  const std::uint32_t source = in.u32();
  if (source > static_cast<std::uint32_t>(ScaleSource::kOdometry))
    contradiction("the source of the scale is unknown");
  return static_cast<ScaleSource>(source);
}

// What the file says it is may be any bytes.
std::string printable(std::string text) {
  if (text.size() > 40) text.resize(40);
  for (char& c : text) c = c >= ' ' && c <= '~' ? c : '?';
  return text;
}

void check_descriptor(const std::string& found, const std::string& expected) {
  if (found == expected) return;
  throw std::runtime_error("has descriptors of another kind (" + printable(found) + "), expected " +
                           expected);
}

// The runs that a file's frames are of, and the model of each one's camera.
struct Sessions {
  std::vector<MapSession> list;
  std::vector<CameraModel> cameras;

  const CameraModel& camera_of(std::int64_t frame_index) const {
    for (std::size_t i = 0; i < list.size(); ++i) {
      if (list[i].holds(frame_index)) return cameras[i];
    }
    contradiction("a frame belongs to no session");
  }
};

Keyframe read_keyframe(ByteReader& in, const Sessions& sessions) {
  Keyframe keyframe;
  keyframe.id = id(in);
  keyframe.frame_index = frame_index(in);
  keyframe.stamp_ns = stamp(in);
  keyframe.camera_from_map = read_transform(in);
  const std::uint32_t n = in.count(kFeatureBytes);
  FeatureSet set;
  set.features.resize(n);
  set.descriptors = cv::Mat(static_cast<int>(n), kMapFileDescriptorBytes, CV_8U);
  std::vector<cv::Vec3b> colors(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    Feature& f = set.features[i];
    for (float* value : {&f.pixel.x(), &f.pixel.y(), &f.scale, &f.angle, &f.response}) {
      *value = static_cast<float>(finite(in.f32()));
    }
    if (f.scale <= 0) contradiction("the scale of a feature is not positive");
    for (int c = 0; c < 3; ++c) colors[i][c] = in.u8();
    std::memcpy(set.descriptors.ptr(static_cast<int>(i)), in.raw(kMapFileDescriptorBytes).data(),
                kMapFileDescriptorBytes);
  }
  const CameraModel& camera = sessions.camera_of(keyframe.frame_index);
  const auto pixels = static_cast<std::size_t>(camera.width()) * static_cast<std::size_t>(camera.height());
  // Every image gets a grid over its pixels, of a byte for 144 px, independent of its number of features.
  // This limit of pixels per byte of the file is twice that of 100 megapixels with 100 features.
  if (pixels / (1 << 14) > kKeyframeBytes + n * kFeatureBytes)
    contradiction("an image is too large for its number of features");
  try {
    keyframe.image = restore_image_features(std::move(set), std::move(colors), camera);
  } catch (const std::invalid_argument& e) {
    contradiction(e.what());
  }
  return keyframe;
}

std::vector<Keyframe> read_keyframes(ByteReader& in, const Sessions& sessions) {
  const std::uint32_t n = in.count(kKeyframeBytes);
  if (n == 0) contradiction("it has no keyframe");
  std::vector<Keyframe> keyframes;
  keyframes.reserve(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    keyframes.push_back(read_keyframe(in, sessions));
  }
  return keyframes;
}

std::map<KeyframeId, KeyframeLink> read_removed(ByteReader& in, const Sessions& sessions) {
  std::map<KeyframeId, KeyframeLink> removed;
  for (std::uint32_t n = in.count(kRemovedBytes); n > 0; --n) {
    KeyframeLink& link = removed[id(in)];
    link.frame_index = frame_index(in);
    sessions.camera_of(link.frame_index);  // there is one
    link.parent = id(in);
    link.removed_from_parent = read_transform(in);
  }
  return removed;
}

std::vector<Landmark> read_landmarks(ByteReader& in) {
  std::vector<Landmark> landmarks(in.count(kLandmarkBytes));
  for (Landmark& landmark : landmarks) {
    landmark.id = id(in);
    for (int i = 0; i < 3; ++i) landmark.x_in_map[i] = finite(in.f64());
    landmark.created_by = id_or_none(in);
    landmark.observations.resize(in.count(kObservationBytes));
    if (landmark.observations.size() < 2) contradiction("a landmark has fewer than two observations");
    for (Observation& o : landmark.observations) {
      o.keyframe = id(in);
      o.feature = id(in);
    }
  }
  return landmarks;
}

// bytes: of what was read.
void check_pairs(std::size_t keyframes, const std::vector<Landmark>& landmarks, std::size_t bytes) {
  std::size_t pairs = 0;
  for (const Landmark& landmark : landmarks) {
    pairs += landmark.observations.size() * landmark.observations.size();
    pairs = std::min(pairs, keyframes * keyframes);
  }
  // A map stores the number of shared landmarks of each pair of keyframes. This limit of pairs per byte of
  // the file is four times that of 3,000 keyframes of 20 features with the same landmarks.
  if (pairs / 4 > bytes) contradiction("too many pairs of keyframes for the file size");
}

ByteReader open_section(const char* name, ByteReader& in) {
  const std::string_view head = in.raw(12);
  const std::uint32_t crc = in.u32();
  const std::string_view payload = in.raw(ByteReader(head.substr(4)).u64());
  if (map_file_crc(head, payload) != crc || head.substr(0, 4) != name) {
    throw std::runtime_error(std::string("is damaged (wrong checksum of section ") + name + ")");
  }
  return ByteReader(payload);
}

void close_section(const ByteReader& section) {
  if (section.left() > 0) contradiction("a section is longer than its content");
}

Map read_map(ByteReader& in, const Sessions& sessions, ScaleSource scale_source) {
  ByteReader section = open_section("KEYF", in);
  std::size_t bytes = section.left();
  std::vector<Keyframe> keyframes = read_keyframes(section, sessions);
  close_section(section);
  section = open_section("REMV", in);
  std::map<KeyframeId, KeyframeLink> removed = read_removed(section, sessions);
  close_section(section);
  section = open_section("LAND", in);
  bytes += section.left();
  std::vector<Landmark> landmarks = read_landmarks(section);
  close_section(section);
  check_pairs(keyframes.size(), landmarks, bytes);
  try {
    return Map::restore(std::move(keyframes), std::move(landmarks), std::move(removed), scale_source);
  } catch (const std::invalid_argument& e) {
    contradiction(e.what());
  }
}

// Version 1 does not say which frames its run had: those that the map names.
MapSession session_of(const Map& map, const CameraParameters& camera) {
  std::int64_t first = map.keyframes().begin()->second.frame_index, last = first;
  const auto take = [&](std::int64_t frame_index) {
    first = std::min(first, frame_index);
    last = std::max(last, frame_index);
  };
  for (const auto& entry : map.keyframes()) take(entry.second.frame_index);
  for (const auto& entry : map.removed_keyframes()) take(entry.second.frame_index);
  return {camera, first, last - first + 1};
}

SavedMaps read_version_1(ByteReader& in, std::uint32_t sections, const std::string& descriptor) {
  if (sections != 1 + kMapFileSectionsOfMap)
    throw std::runtime_error("is damaged (wrong number of sections)");
  SavedMaps saved;
  ByteReader section = open_section("ORIG", in);
  const CameraParameters camera = read_camera(section);
  saved.descriptor = section.text();
  const ScaleSource scale_source = read_scale_source(section);
  close_section(section);
  check_descriptor(saved.descriptor, descriptor);
  const Sessions all{{{camera, -kMostFrames, 2 * kMostFrames + 1}}, {model_of(camera)}};
  saved.maps.push_back(read_map(in, all, scale_source));
  saved.sessions.push_back(session_of(saved.maps.front(), camera));
  return saved;
}

MapSession read_session(ByteReader& in, const std::vector<CameraParameters>& cameras) {
  const std::uint32_t camera = in.u32();
  if (camera >= cameras.size()) contradiction("a session refers to an unknown camera");
  MapSession session{cameras[camera], frame_index(in), frame_index(in)};
  if (session.frames < 1) contradiction("a session has no frames");
  return session;
}

// Sessions and scales; `scales` has one for each map.
Sessions read_head(ByteReader& in, const std::string& descriptor, std::vector<ScaleSource>* scales) {
  check_descriptor(in.text(), descriptor);
  std::vector<CameraParameters> cameras;
  for (std::uint32_t n = in.count(kCameraBytes); n > 0; --n) cameras.push_back(read_camera(in));
  Sessions sessions;
  for (std::uint32_t n = in.count(kSessionBytes); n > 0; --n) {
    const MapSession session = read_session(in, cameras);
    if (!sessions.list.empty()) {
      const MapSession& before = sessions.list.back();
      if (session.first_frame < before.first_frame + before.frames) contradiction("sessions overlap");
    }
    sessions.list.push_back(session);
    sessions.cameras.push_back(model_of(session.camera));
  }
  for (std::uint32_t n = in.count(4); n > 0; --n) scales->push_back(read_scale_source(in));
  return sessions;
}

SavedMaps read_version_2(ByteReader& in, std::uint32_t sections, const std::string& descriptor) {
  std::vector<ScaleSource> scales;
  ByteReader section = open_section("HEAD", in);
  const Sessions sessions = read_head(section, descriptor, &scales);
  close_section(section);
  if (scales.empty() || sections != 1 + kMapFileSectionsOfMap * scales.size()) {
    throw std::runtime_error("is damaged (wrong number of sections)");
  }
  SavedMaps saved{descriptor, sessions.list, {}};
  for (const ScaleSource scale : scales) saved.maps.push_back(read_map(in, sessions, scale));
  return saved;
}

}  // namespace

void SavedMaps::end_before_zero() {
  if (sessions.empty()) return;
  const std::int64_t end = sessions.back().first_frame + sessions.back().frames;
  for (MapSession& session : sessions) session.first_frame -= end;
  for (Map& map : maps) map.shift_frame_indices(-end);
}

SavedMaps parse_maps(std::string_view bytes, const std::string& descriptor) {
  if (bytes.substr(0, kMapFileMagic.size()) != kMapFileMagic) throw std::runtime_error("is not a map file");
  ByteReader in(bytes.substr(kMapFileMagic.size()));
  const std::uint32_t version = in.u32();
  if (version != 1 && version != 2) {
    throw std::runtime_error("is of version " + std::to_string(version) + ", expected 1 or 2");
  }
  const std::uint32_t sections = in.u32();
  SavedMaps saved =
      version == 1 ? read_version_1(in, sections, descriptor) : read_version_2(in, sections, descriptor);
  if (in.left() > 0) throw std::runtime_error("is damaged (data after the last section)");
  return saved;
}

SavedMaps read_map_file(const std::string& path, const std::string& descriptor) {
  // A device could be read for ever.
  if (std::filesystem::exists(path) && !std::filesystem::is_regular_file(path)) {
    throw std::runtime_error(path + ": is not a regular file, expected a map file");
  }
  const std::string bytes = read_text_file(path, "a map file", std::numeric_limits<std::size_t>::max());
  try {
    return parse_maps(bytes, descriptor);
  } catch (const std::exception& e) {
    throw std::runtime_error(path + ": " + e.what());
  }
}

}  // namespace mono_pose_tracker
