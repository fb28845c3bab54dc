#include "io/name_order.h"

#include <gtest/gtest.h>

namespace mono_pose_tracker {
namespace {

using Names = std::vector<std::string>;

TEST(NameOrder, NumbersGoByTheirValue) {
  EXPECT_EQ(in_order_of_names({"frame_10.png", "frame_9.png", "frame_100.png", "frame_1.png"}),
            (Names{"frame_1.png", "frame_9.png", "frame_10.png", "frame_100.png"}));
  EXPECT_EQ(in_order_of_names({"b2_1.png", "a10_2.png", "a10_1.png", "a9_3.png"}),
            (Names{"a9_3.png", "a10_1.png", "a10_2.png", "b2_1.png"}));
}

TEST(NameOrder, OfOneLengthTheyGoAsText) {
  EXPECT_EQ(in_order_of_names({"0010.png", "0002.png", "0001.jpg"}),
            (Names{"0001.jpg", "0002.png", "0010.png"}));
}

TEST(NameOrder, FractionsOfASecondGoAsText) {
  EXPECT_EQ(in_order_of_names({"1403636579.81.png", "1403636579.7635.png", "999.5.png"}),
            (Names{"999.5.png", "1403636579.7635.png", "1403636579.81.png"}));
}

TEST(NameOrder, EachIsThereOnce) {
  EXPECT_EQ(in_order_of_names({"007.png", "7.png", "07.png"}), (Names{"007.png", "07.png", "7.png"}));
  EXPECT_TRUE(in_order_of_names({}).empty());
}

}  // namespace
}  // namespace mono_pose_tracker
