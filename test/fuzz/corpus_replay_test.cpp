// Every input in corpus/TARGET, also those that once were a find, by the fuzz targets themselves.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "fuzz_target.h"

namespace mono_pose_tracker {
namespace {

namespace fs = std::filesystem;

struct Input {
  std::string target;
  fs::path path;
};

std::string name_of(const testing::TestParamInfo<Input>& info) {
  std::string name = info.param.target + "_" + info.param.path.filename().string();
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return name;
}

std::vector<Input> corpus() {
  std::vector<Input> inputs;
  for (const auto& target : fuzz_targets()) {
    const fs::path folder = fs::path(FUZZ_CORPUS) / target.first;
    if (!fs::is_directory(folder)) continue;
    for (const fs::directory_entry& file : fs::directory_iterator(folder)) {
      inputs.push_back({target.first, file.path()});
    }
  }
  std::sort(inputs.begin(), inputs.end(), [](const Input& a, const Input& b) { return a.path < b.path; });
  return inputs;
}

class CorpusReplay : public testing::TestWithParam<Input> {};

// A check that does not hold, or a crash, ends the program: which counts as a failure of all.
TEST_P(CorpusReplay, IsTaken) {
  std::ifstream stream(GetParam().path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  EXPECT_NO_THROW(fuzz_targets().at(GetParam().target)(reinterpret_cast<const std::uint8_t*>(bytes.data()),
                                                       bytes.size()));
}

INSTANTIATE_TEST_SUITE_P(Inputs, CorpusReplay, testing::ValuesIn(corpus()), name_of);

TEST(Corpus, EveryTargetHasInputs) {
  for (const auto& target : fuzz_targets()) {
    const fs::path folder = fs::path(FUZZ_CORPUS) / target.first;
    EXPECT_TRUE(fs::is_directory(folder) && !fs::is_empty(folder)) << target.first;
  }
  EXPECT_GE(fuzz_targets().size(), 10u);
}

}  // namespace
}  // namespace mono_pose_tracker
