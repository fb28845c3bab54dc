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

TEST(NameOrder, ANameGoesBeforeThoseThatGoOn) {
  EXPECT_EQ(in_order_of_names({"1.5.png", "1.png", "0.5.png", "10.png", "2.png"}),
            (Names{"0.5.png", "1.png", "1.5.png", "2.png", "10.png"}));
  EXPECT_EQ(in_order_of_names({"shot (10).png", "shot (1).png", "shot.png", "shot (2).png"}),
            (Names{"shot.png", "shot (1).png", "shot (2).png", "shot (10).png"}));
  EXPECT_EQ(in_order_of_names({"IMG_1-1.jpg", "IMG_1.jpg", "IMG_1_2.JPG", "IMG_2.jpg"}),
            (Names{"IMG_1.jpg", "IMG_1-1.jpg", "IMG_1_2.JPG", "IMG_2.jpg"}));
  EXPECT_EQ(in_order_of_names({"1305031103.05.png", "1305031103.png", "1305031102.95.png"}),
            (Names{"1305031102.95.png", "1305031103.png", "1305031103.05.png"}));
}

TEST(NameOrder, EachIsThereOnce) {
  EXPECT_EQ(in_order_of_names({"007.png", "7.png", "07.png"}), (Names{"007.png", "07.png", "7.png"}));
  EXPECT_TRUE(in_order_of_names({}).empty());
}

}  // namespace
}  // namespace mono_pose_tracker
