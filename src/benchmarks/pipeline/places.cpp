#include "places.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>

#include "common/rotation.h"
#include "common/statistics.h"
#include "io/image_source.h"
#include "mapping/place_index.h"
#include "mono_pose_tracker/camera/camera_model.h"
#include "mono_pose_tracker/features/matching.h"
#include "mono_pose_tracker/features/sift.h"
#include "mono_pose_tracker/io/camera_yaml.h"
#include "mono_pose_tracker/io/trajectory.h"
#include "mono_pose_tracker/map/image_features.h"
#include "mono_pose_tracker/robust/relative_pose.h"
#include "runs.h"
#include "tools/json.h"

namespace mono_pose_tracker {
namespace {

constexpr std::int64_t kBarredNs = 2'000'000'000;
constexpr std::int64_t kMaxStampDifferenceNs = 10'000'000;  // those of lists are rounded differently
constexpr int kBest = 5;
// Five points fix the geometry; fifteen more agree by chance about never.
constexpr int kMinInliers = 20;
// Of the truth: redkitchen's is off by 2.3 itself.
constexpr double kMaxRotationDeg = 5;

struct View {
  std::int64_t stamp_ns = 0;
  ImageFeaturesPtr features;
  Eigen::Quaterniond map_from_camera;
};

struct Place {
  std::string name;
  double focal_px = 0;
  std::vector<View> keyframes, queries;
};

const StampedPose* pose_at(const std::vector<StampedPose>& truth, std::int64_t stamp_ns) {
  for (const StampedPose& pose : truth) {
    if (std::llabs(pose.stamp_ns - stamp_ns) < kMaxStampDifferenceNs) return &pose;
  }
  return nullptr;
}

/// The images that have a true pose: every `stride`-th is a keyframe, and one between each two is looked for.
Place read_place(const std::string& folder, int images, const TrackerOptions& options) {
  Place place;
  place.name = std::filesystem::path(folder).filename().string();
  const CameraModel camera(read_camera_yaml(folder + "/camera.yaml"));
  place.focal_px = camera.focal();
  const std::vector<StampedPose> truth = read_tum(folder + "/groundtruth.txt");
  const auto source = open_images(folder + "/images.txt");
  std::optional<MaskFolder> masks;
  if (std::filesystem::is_directory(folder + "/masks")) masks.emplace(folder + "/masks");
  const auto extractor = make_sift_extractor(options.sift);
  const int stride = std::max(2, source->size() / images);
  for (int i = 0;; ++i) {
    const SourceImage image = source->next();
    if (image.kind == SourceImage::Kind::kEnd) break;
    const StampedPose* pose = pose_at(truth, image.stamp_ns);
    const bool query = i % stride == stride / 2;
    if (image.kind != SourceImage::Kind::kImage || !pose || (i % stride != 0 && !query)) continue;
    cv::Mat gray = image.image, mask;
    if (gray.channels() == 3) cv::cvtColor(image.image, gray, cv::COLOR_BGR2GRAY);
    std::string problem;
    if (masks) mask = masks->mask_of(image.name, gray.size(), &problem);
    FeatureSet set;
    extractor->extract(gray, mask, &set);
    (query ? place.queries : place.keyframes)
        .push_back({image.stamp_ns, make_image_features(std::move(set), image.image, camera),
                    pose->map_from_camera.rotation});
  }
  if (place.keyframes.empty()) throw std::runtime_error(folder + ": no image has a true pose");
  return place;
}

bool barred(const View& a, const View& b) { return std::llabs(a.stamp_ns - b.stamp_ns) <= kBarredNs; }

/// What brute force says: a keyframe shows what the image shows.
bool is_right(const View& query, const View& keyframe, double focal_px, const TrackerOptions& options) {
  RelativePoseOptions two_view;
  two_view.ransac = options.ransac(focal_px);
  two_view.max_hypotheses = 1;
  std::vector<Eigen::Vector3d> in_query, in_keyframe;
  for (const Match& m : match_descriptors(query.features->set.descriptors, keyframe.features->set.descriptors,
                                          options.matching)) {
    in_query.push_back(query.features->set.bearings[m.first]);
    in_keyframe.push_back(keyframe.features->set.bearings[m.second]);
    two_view.quality.push_back(m.ratio);
  }
  if (static_cast<int>(in_query.size()) < kMinInliers) return false;
  const RelativePoseReport report = estimate_relative_pose(in_query, in_keyframe, two_view);
  if (!report.success || report.hypotheses[0].num_inliers < kMinInliers) return false;
  const Eigen::Quaterniond truth = keyframe.map_from_camera.conjugate() * query.map_from_camera;
  return rotation_angle_between(report.hypotheses[0].second_from_first.rotation, truth) <
         kMaxRotationDeg * kDegree;
}

/// Features of others', each off by up to 20 of 255 in every element.
FeatureSet mixed_keyframe(const std::vector<const FeatureSet*>& others, Random& random) {
  constexpr int kFeatures = 1000, kOff = 20;
  FeatureSet set;
  while (set.size() < kFeatures) {
    const FeatureSet& other = *others[random.index(others.size())];
    if (other.size() == 0) continue;
    const int k = static_cast<int>(random.index(other.size()));
    cv::Mat row = other.descriptors.row(k).clone();
    for (int i = 0; i < row.cols; ++i) {
      std::uint8_t& value = row.at<std::uint8_t>(i);
      value = cv::saturate_cast<std::uint8_t>(value + static_cast<int>(random.index(2 * kOff + 1)) - kOff);
    }
    set.features.push_back(other.features[k]);
    set.descriptors.push_back(row);
  }
  return set;
}

struct Indexed {
  PlaceIndex index;
  std::vector<double> add_ms;
  std::vector<const View*> view_of;  // by keyframe id; null of a synthetic one
  std::vector<const Place*> place_of;

  void add(const FeatureSet& features, const View* view, const Place* place) {
    const double start = thread_cpu_ms();
    index.add(static_cast<KeyframeId>(view_of.size()), features);
    add_ms.push_back(thread_cpu_ms() - start);
    view_of.push_back(view);
    place_of.push_back(place);
  }
};

void fill(const std::vector<Place>& places, int keyframes, Indexed* indexed) {
  std::vector<const FeatureSet*> sets;
  for (const Place& place : places) {
    for (const View& view : place.keyframes) {
      indexed->add(view.features->set, &view, &place);
      sets.push_back(&view.features->set);
    }
  }
  const bool any = std::any_of(sets.begin(), sets.end(), [](const FeatureSet* s) { return s->size() > 0; });
  Random random(0);
  while (any && indexed->index.size() < keyframes)
    indexed->add(mixed_keyframe(sets, random), nullptr, nullptr);
}

/// Looks for the images of one folder; the times go to query_ms.
Json look_for(const Place& place, const Indexed& indexed, const TrackerOptions& options,
              std::vector<double>* query_ms) {
  int localised = 0, found = 0, first = 0;
  for (const View& query : place.queries) {
    std::vector<const View*> right;
    for (const View& keyframe : place.keyframes) {
      if (!barred(query, keyframe) && is_right(query, keyframe, place.focal_px, options)) {
        right.push_back(&keyframe);
      }
    }
    if (right.empty()) continue;
    ++localised;
    const double start = thread_cpu_ms();
    const std::vector<PlaceMatch> best = indexed.index.query(query.features->set, kBest, [&](KeyframeId id) {
      return indexed.place_of[id] != &place || !barred(query, *indexed.view_of[id]);
    });
    query_ms->push_back(thread_cpu_ms() - start);
    const auto is_one = [&](const PlaceMatch& match) {
      return std::find(right.begin(), right.end(), indexed.view_of[match.id]) != right.end();
    };
    found += std::any_of(best.begin(), best.end(), is_one);
    first += !best.empty() && is_one(best.front());
  }
  return {{"keyframes", place.keyframes.size()},
          {"queries", place.queries.size()},
          {"brute_force", localised},
          {"best_5", found},
          {"best_1", first}};
}

}  // namespace

Json run_place_study(const PlaceStudyOptions& study, const TrackerOptions& options) {
  std::vector<Place> places;
  for (const std::string& folder : study.folders) {
    places.push_back(read_place(folder, study.images_per_folder, options));
  }
  Indexed indexed;
  fill(places, study.keyframes, &indexed);
  Json result;
  std::vector<double> query_ms;
  int localised = 0, found = 0;
  for (const Place& place : places) {
    const Json of_place = look_for(place, indexed, options, &query_ms);
    localised += of_place["brute_force"].get<int>();
    found += of_place["best_5"].get<int>();
    result["sequences"][place.name] = of_place;
  }
  result["recall_5"] = localised > 0 ? static_cast<double>(found) / localised : 0;
  result["keyframes"] = indexed.index.size();
  result["query_ms"] = time_statistics(query_ms);
  result["add_ms"] = time_statistics(indexed.add_ms);
  result["kb_per_keyframe"] = 1e-3 * indexed.index.memory_bytes() / std::max(1, indexed.index.size());
  return result;
}

std::string place_table(const Json& places) {
  std::string table = "sequence              keyframes  images  brute force  best 5  best 1\n";
  char line[200];
  for (const auto& [name, s] : places["sequences"].items()) {
    std::snprintf(line, sizeof line, "%-20s  %9d  %6d  %11d  %6d  %6d\n", name.c_str(),
                  s["keyframes"].get<int>(), s["queries"].get<int>(), s["brute_force"].get<int>(),
                  s["best_5"].get<int>(), s["best_1"].get<int>());
    table += line;
  }
  std::snprintf(line, sizeof line,
                "recall of the best 5: %.1f %%; %d keyframes, %.1f kB each; CPU ms: query %.2f (p95 %.2f), "
                "add %.2f (p95 %.2f)\n",
                100 * places["recall_5"].get<double>(), places["keyframes"].get<int>(),
                places["kb_per_keyframe"].get<double>(), places["query_ms"]["median_ms"].get<double>(),
                places["query_ms"]["p95_ms"].get<double>(), places["add_ms"]["median_ms"].get<double>(),
                places["add_ms"]["p95_ms"].get<double>());
  return table + line;
}

}  // namespace mono_pose_tracker
