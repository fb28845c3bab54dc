#include "benchmark_report.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace mono_pose_tracker {
namespace {

template <typename... Values>
std::string line(const char* format, Values... values) {
  char text[256];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

std::string time_columns(const Json& run, const Json::json_pointer& where) {
  if (!run.contains(where)) return line("%9s%9s%9s", "-", "-", "-");
  const Json& times = run.at(where);
  return line("%9.2f%9.2f%9.2f", times.at("median_ms").get<double>(), times.at("p95_ms").get<double>(),
              times.at("max_ms").get<double>());
}

std::string number(const Json& run, const Json::json_pointer& where, const char* format) {
  if (!run.contains(where) || !run.at(where).is_number()) return "-";
  return line(format, run.at(where).get<double>());
}

std::vector<std::string> stage_names(const std::vector<const Json*>& runs) {
  std::vector<std::string> names;
  for (const Json* run : runs) {
    for (const auto& entry : run->at("stages").items()) {
      if (std::find(names.begin(), names.end(), entry.key()) == names.end()) names.push_back(entry.key());
    }
  }
  return names;
}

struct Row {
  const char* title;
  const char* where;
  const char* format;
};

constexpr Row kRows[] = {
    {"frames", "/frames_total", "%.0f"},
    {"  registered", "/frames_posed", "%.0f"},
    {"    not in the largest map", "/frames_posed_in_other_maps", "%.0f"},
    {"  not registered", "/frames_not_posed", "%.0f"},
    {"  dropped", "/frames_dropped", "%.0f"},
    {"keyframes", "/keyframes", "%.0f"},
    {"landmarks", "/landmarks", "%.0f"},
    {"worker's backlog, most", "/backlog_max", "%.0f"},
    {"load level, most", "/load_level_max", "%.0f"},
    {"memory before, MB", "/memory_mb/before", "%.1f"},
    {"  peak", "/memory_mb/peak", "%.1f"},
    {"  after", "/memory_mb/after", "%.1f"},
    {"seconds", "/seconds", "%.1f"},
    {"  CPU, all threads", "/cpu_seconds", "%.1f"},
    {"position rmse, % of path", "/position_rmse_percent", "%.4f"},
    {"  as they came", "/position_rmse_percent_as_they_came", "%.4f"},
    {"  on the final map", "/position_rmse_percent_on_final_map", "%.4f"},
    {"  of that from offline", "/position_percent_from_offline", "%.4f"},
    {"poses far from offline", "/doubt/poses_off", "%.0f"},
    {"  reported doubtful", "/doubt/poses_off_doubtful", "%.0f"},
    {"doubtful in all", "/doubt/poses_doubtful", "%.0f"},
};

// Leaves that are settings or names, not figures to compare.
bool is_figure(const std::string& path, const Json& value) {
  constexpr std::array<const char*, 5> kMeasured = {"/offline", "/live", "/soak", "/growth", "/places"};
  constexpr std::array<const char*, 3> kSettings = {"median_ms_of_runs", "rate_hz", "/soak/minutes"};
  const auto is_under = [&](const char* root) { return path.rfind(root, 0) == 0; };
  const auto holds = [&](const char* name) { return path.find(name) != std::string::npos; };
  return value.is_number() && std::any_of(kMeasured.begin(), kMeasured.end(), is_under) &&
         std::none_of(kSettings.begin(), kSettings.end(), holds);
}

}  // namespace

std::string benchmark_table(const Json& result) {
  std::vector<const Json*> runs;
  std::string heading = line("%-26s", ""), columns = line("%-26s", "ms");
  const auto add = [&](const char* key, const std::string& title) {
    if (!result.contains(key)) return;
    runs.push_back(&result.at(key));
    heading += line("%27s", title.c_str());
    columns += line("%9s%9s%9s", "median", "p95", "max");
  };
  add("offline", "offline");
  add("live", "live at " + number(result, Json::json_pointer("/live/rate_hz"), "%g") + " Hz");
  std::string text = heading + "\n" + columns + "\n";
  const auto add_times = [&](const std::string& title, const std::string& where) {
    text += line("%-26s", title.c_str());
    for (const Json* run : runs) text += time_columns(*run, Json::json_pointer(where));
    text += "\n";
  };
  for (const std::string& stage : stage_names(runs)) add_times(stage, "/stages/" + stage);
  add_times("frame, all stages", "/frame");
  add_times("  its CPU time", "/frame_cpu");
  add_times("image received to pose", "/latency");
  for (const Row& row : kRows) {
    text += line("%-26s", row.title);
    for (const Json* run : runs) {
      text += line("%27s", number(*run, Json::json_pointer(row.where), row.format).c_str());
    }
    text += "\n";
  }
  return text;
}

Json read_benchmark(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  Json json = Json::parse(file, nullptr, false);
  if (!json.is_object() || json.value("program", "") != "pipeline_benchmark") {
    throw std::runtime_error(path + ": expected the output of pipeline_benchmark --json");
  }
  return json;
}

std::string comparison_table(const Json& earlier, const Json& now) {
  const Json before = earlier.flatten(), after = now.flatten();
  std::string text = line("%-50s%12s%12s%9s\n", "", "earlier", "now", "ratio");
  for (const auto& entry : after.items()) {
    if (!before.contains(entry.key())) continue;
    const Json& old = before.at(entry.key());
    if (!is_figure(entry.key(), entry.value()) || !is_figure(entry.key(), old)) continue;
    const double from = old.get<double>(), to = entry.value().get<double>();
    const std::string ratio = from != 0 ? line("%.3f", to / from) : to == 0 ? "1.000" : "-";
    text += line("%-50s%12.6g%12.6g%9s\n", entry.key().substr(1).c_str(), from, to, ratio.c_str());
  }
  return text;
}

}  // namespace mono_pose_tracker
