#include "long_runs.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>

#include "mono_pose_tracker/evaluation/trajectory_error.h"
#include "runs.h"
#include "simulation/endless_room.h"
#include "simulation/walk_studies.h"
#include "tools/json.h"
#include "tools/progress.h"

namespace mono_pose_tracker {
namespace {

using Clock = LivePipeline::Clock;

Json position_error(const std::vector<StampedPose>& truth, const std::vector<StampedPose>& poses) {
  try {
    return evaluate_trajectory(truth, poses, 1'000'000).position_rmse_percent;
  } catch (const std::runtime_error&) {
    return nullptr;
  }
}

/// What is gathered of one minute. put_in is the camera thread's; the rest is the tracking thread's while
/// frames are under way.
struct Minute {
  std::vector<StampedPose> put_in;
  std::vector<double> frame_ms, latency_ms, cpu_ms;
  std::vector<StampedPose> poses;
  double backlog_sum = 0;
  int backlog_max = 0;
  FrameReport last;

  void add(const FrameReport& report, double frame, double latency, double cpu) {
    frame_ms.push_back(frame);
    latency_ms.push_back(latency);
    cpu_ms.push_back(cpu);
    if (report.map_from_camera) poses.push_back({report.stamp_ns, *report.map_from_camera});
    backlog_sum += report.worker_backlog;
    backlog_max = std::max(backlog_max, report.worker_backlog);
    last = report;
  }

  Json result(int number, int dropped, double memory_mb, double all_cpu_ms) const {
    const double tracked = std::max<double>(1, static_cast<double>(frame_ms.size()));
    return {{"minute", number},
            {"frames_total", put_in.size()},
            {"frames_posed", poses.size()},
            {"frames_not_posed", frame_ms.size() - poses.size()},
            {"frames_dropped", dropped},
            {"frame", time_statistics(frame_ms)},
            {"frame_cpu", time_statistics(cpu_ms)},
            {"latency", time_statistics(latency_ms)},
            {"process_cpu_ms_per_frame", all_cpu_ms / tracked},
            {"memory_mb", memory_mb},
            {"backlog_mean", backlog_sum / tracked},
            {"backlog_max", backlog_max},
            {"keyframes", last.keyframes},
            {"landmarks", last.landmarks},
            {"epoch", last.epoch},
            {"position_rmse_percent", position_error(put_in, poses)}};
  }
};

std::string heading() {
  return "minute   reg. not drop   frame ms: median    p95   cpu: median    p95  latency: p95  all cpu "
         "backlog  keyframes landmarks    MB  rmse %\n";
}

std::string minute_line(const Json& m) {
  char text[256];
  const auto ms = [&](const char* what, const char* which) { return m.at(what).at(which).get<double>(); };
  const Json& error = m.at("position_rmse_percent");
  std::snprintf(text, sizeof text, "%6d%7d%4d%5d%19.2f%7.2f%14.2f%7.2f%14.2f%9.2f%8.3f%11d%10d%6.1f%8s\n",
                m.at("minute").get<int>(), m.at("frames_posed").get<int>(),
                m.at("frames_not_posed").get<int>(), m.at("frames_dropped").get<int>(),
                ms("frame", "median_ms"), ms("frame", "p95_ms"), ms("frame_cpu", "median_ms"),
                ms("frame_cpu", "p95_ms"), ms("latency", "p95_ms"),
                m.at("process_cpu_ms_per_frame").get<double>(), m.at("backlog_mean").get<double>(),
                m.at("keyframes").get<int>(), m.at("landmarks").get<int>(), m.at("memory_mb").get<double>(),
                error.is_number() ? std::to_string(error.get<double>()).substr(0, 6).c_str() : "-");
  return text;
}

Json ratios(const Json& minutes) {
  if (minutes.size() < 3) return nullptr;
  const Json before = minutes[1].flatten(), after = minutes.back().flatten();
  Json result;
  for (const char* what : {"/frame/median_ms", "/frame/p95_ms", "/frame_cpu/median_ms", "/frame_cpu/p95_ms",
                           "/latency/median_ms", "/latency/p95_ms", "/process_cpu_ms_per_frame", "/memory_mb",
                           "/backlog_mean", "/keyframes", "/landmarks"}) {
    const double from = before.at(what).get<double>(), to = after.at(what).get<double>();
    result[what + 1] = from != 0 ? Json(to / from) : to == 0 ? Json(1.0) : Json(nullptr);
  }
  return result;
}

using SoakScene = std::function<EndlessRoom::Frame(std::int64_t)>;

SoakScene make_scene(const SoakOptions& options) {
  if (options.corridor) {
    return [corridor = EndlessCorridor(options.room)](std::int64_t i) { return corridor.frame(i); };
  }
  ProgressBar progress(options.room.lap_frames);
  const auto room = std::make_shared<EndlessRoom>(options.room, [&] { progress.advance(); });
  return [room](std::int64_t i) { return room->frame(i); };
}

}  // namespace

Json run_soak(const SoakOptions& options, const TrackerOptions& tracker,
              const std::function<void(const std::string&)>& on_minute) {
  const SoakScene scene = make_scene(options);
  const double rate = options.room.rate_hz;
  const auto frames = static_cast<std::int64_t>(std::llround(60 * rate * options.minutes));
  const auto frames_a_minute = static_cast<std::int64_t>(std::llround(60 * rate));
  const double memory_before = resident_mb();
  Minute minute;
  double cpu_then = process_cpu_ms(), thread_then = 0;
  LivePipeline pipeline(tracker, options.room.camera,
                        [&](const FrameReport& report, double ms, double latency) {
                          const double cpu = thread_cpu_ms();
                          minute.add(report, ms, latency, cpu - std::exchange(thread_then, cpu));
                        });
  Json minutes = Json::array();
  int dropped_then = 0;
  on_minute(heading());
  Clock::time_point start = Clock::now();
  for (std::int64_t i = 0; i < frames; ++i) {
    const EndlessRoom::Frame frame = scene(i);
    const DecodedFrame sent = make_decoded_frame(frame.truth.stamp_ns, "", frame.image);
    std::optional<std::int64_t> due_ns;
    if (options.paced) {
      const std::chrono::duration<double> due(static_cast<double>(i) / rate);
      due_ns = static_cast<std::int64_t>(1e9 * due.count());
      std::this_thread::sleep_until(start + std::chrono::duration_cast<Clock::duration>(due));
    } else {
      pipeline.wait();
    }
    minute.put_in.push_back(frame.truth);
    pipeline.put(sent.message, due_ns);
    if ((i + 1) % frames_a_minute != 0 && i + 1 != frames) continue;
    pipeline.wait();
    const int dropped = pipeline.counts().dropped;
    const double cpu_now = process_cpu_ms();
    minutes.push_back(minute.result(static_cast<int>(minutes.size()) + 1, dropped - dropped_then,
                                    resident_mb() - memory_before, cpu_now - cpu_then));
    on_minute(minute_line(minutes.back()));
    dropped_then = dropped;
    cpu_then = cpu_now;
    minute = Minute();
  }
  Json result = {{"rate_hz", rate}, {"paced", options.paced}};
  result["last_to_second"] = ratios(minutes);
  result["minutes"] = std::move(minutes);
  return result;
}

std::string soak_ratios(const Json& soak) {
  const Json& last = soak.at("last_to_second");
  if (last.is_null()) return "";
  std::string text = "last minute : second minute\n";
  char line[128];
  for (const auto& entry : last.items()) {
    if (!entry.value().is_number()) continue;
    std::snprintf(line, sizeof line, "%-28s%7.3f\n", entry.key().c_str(), entry.value().get<double>());
    text += line;
  }
  return text;
}

namespace {

constexpr int kFinishUpTo = 1600;  // keyframes

// 100, 200, 400, ...
std::vector<int> sizes_up_to(int most) {
  std::vector<int> sizes;
  for (int size = 100; size <= most; size *= 2) sizes.push_back(size);
  return sizes;
}

Json grow(const FeatureWalk& walk, const std::vector<int>& sizes, const TrackerOptions& options) {
  const double memory_before = resident_mb();
  Json steps = Json::array();
  for (const GrowthStep& step : run_growth_study(walk, walk_camera(), options, sizes, kFinishUpTo)) {
    steps.push_back({{"keyframes", step.keyframes},
                     {"landmarks", step.landmarks},
                     {"keyframe_ms", step.keyframe_ms},
                     {"publish_ms", step.publish_ms},
                     {"finish_s", step.finish_s},
                     {"global_adjust_s", step.global_adjust_s}});
  }
  const double memory = peak_resident_mb() - memory_before;
  return {{"steps", steps}, {"mb_per_keyframe", memory / sizes.back()}};
}

}  // namespace

Json run_growth(int most_keyframes, const TrackerOptions& options) {
  // Frames to spare: not each becomes a keyframe.
  const std::vector<int> street = sizes_up_to(most_keyframes),
                         wall = sizes_up_to(std::max(100, most_keyframes / 4));
  const auto frames = [](const std::vector<int>& sizes) { return sizes.back() + sizes.back() / 10 + 10; };
  Json result;
  result["street"] = grow(street_walk(options.seed, frames(street)), street, options);
  result["wall"] = grow(wall_walk(options.seed, frames(wall)), wall, options);
  return result;
}

std::string growth_table(const Json& growth) {
  std::string table;
  char line[200];
  for (const auto& [scene, result] : growth.items()) {
    table += scene + "\nkeyframes  landmarks  ms a keyframe  snapshot ms  finish s  global adjustment s\n";
    for (const Json& step : result["steps"]) {
      std::snprintf(line, sizeof line, "%9d  %9d  %13.1f  %11.2f  %8.2f  %19.2f\n",
                    step["keyframes"].get<int>(), step["landmarks"].get<int>(),
                    step["keyframe_ms"].get<double>(), step["publish_ms"].get<double>(),
                    step["finish_s"].get<double>(), step["global_adjust_s"].get<double>());
      table += line;
    }
    std::snprintf(line, sizeof line, "%.2f MB a keyframe\n", result["mb_per_keyframe"].get<double>());
    table += line;
  }
  return table;
}

}  // namespace mono_pose_tracker
