#include "mono_pose_tracker/map/shared_map.h"

#include <gtest/gtest.h>

#include <map>
#include <string>

#include "common/statistics.h"

namespace mono_pose_tracker {
namespace {

template <typename Shared, typename Value>
void expect_same(const Shared& shared, const std::map<int, Value>& truth) {
  ASSERT_EQ(shared.size(), truth.size());
  auto expected = truth.begin();
  for (const auto& [id, value] : shared) {
    EXPECT_EQ(id, expected->first);
    EXPECT_EQ(value, (expected++)->second);
  }
  auto backwards = truth.rbegin();
  for (auto entry = shared.rbegin(); entry != shared.rend(); ++entry, ++backwards) {
    EXPECT_EQ((*entry).first, backwards->first);
  }
}

// Against std::map, through changes at random; each copy made on the way stays as it was.
template <int kChunk>
void try_changes() {
  Random random(1);
  SharedMap<std::string, kChunk> shared;
  std::map<int, std::string> truth;
  std::vector<std::pair<SharedMap<std::string, kChunk>, std::map<int, std::string>>> copies;
  for (int round = 0; round < 60; ++round) {
    std::map<int, std::optional<std::string>> changes;
    for (int i = 0; i < 8; ++i) {
      const int id = static_cast<int>(random.uniform(0, 50));
      if (random.uniform(0, 1) < 0.4) {
        changes[id] = std::nullopt;
        truth.erase(id);
      } else {
        changes[id] = truth[id] = std::to_string(round) + "/" + std::to_string(id);
      }
    }
    shared.change(changes);
    copies.emplace_back(shared, truth);
    for (int id = -1; id < 51; ++id) {
      ASSERT_EQ(shared.count(id), truth.count(id)) << id;
      if (truth.count(id)) {
        EXPECT_EQ(shared.at(id), truth.at(id));
        EXPECT_EQ(shared.find(id)->second, truth.at(id));
      } else {
        EXPECT_EQ(shared.find(id), shared.end());
        EXPECT_THROW(shared.at(id), std::out_of_range);
      }
      const auto after = truth.upper_bound(id);
      const auto found = shared.upper_bound(id);
      ASSERT_EQ(found == shared.end(), after == truth.end()) << id;
      if (after != truth.end()) {
        EXPECT_EQ(found->first, after->first);
      }
    }
  }
  for (const auto& [copy, as_it_was] : copies) expect_same(copy, as_it_was);
}

TEST(SharedMap, ReadsAsAMapThroughChanges) { try_changes<1>(); }

TEST(SharedMap, ReadsAsAMapInChunks) { try_changes<16>(); }

TEST(SharedMap, ACopySharesWhatHasNotChanged) {
  SharedMap<std::string, 4> shared;
  for (int id = 0; id < 12; ++id) shared.set(id, "value " + std::to_string(id));
  const SharedMap<std::string, 4> before = shared;
  shared.set(5, "another");
  EXPECT_EQ(before.at(5), "value 5");
  EXPECT_EQ(&before.at(0), &shared.at(0));
  EXPECT_EQ(&before.at(11), &shared.at(11));
  EXPECT_NE(&before.at(4), &shared.at(4)) << "of one chunk with what has changed";
}

}  // namespace
}  // namespace mono_pose_tracker
