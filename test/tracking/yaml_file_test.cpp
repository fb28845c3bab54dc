#include "io/yaml_file.h"

#include <gtest/gtest.h>

#include "mono_pose_tracker/io/camera_yaml.h"
#include "mono_pose_tracker/tracking/options_table.h"
#include "support/expect_error.h"
#include "support/temporary_folder.h"

namespace mono_pose_tracker {
namespace {

using Kind = YamlValue::Kind;

// Its content would be ignored.
TEST(Yaml, ASecondDocumentIsRefused) {
  expect_error([] { parse_yaml("a: 1\n---\nb: 2\n", "x"); }, {"line 3", "second document"});
  expect_error([] { parse_yaml("a: 1\n---\n[2]\n", "x"); }, {"second document"});
  // Documents that begin here have no end.
  expect_error([] { parse_yaml("{a: 1}, b\n", "x"); }, {"line 1", "second document"});
  for (const char* one : {"a: 1\n", "---\na: 1\n...\n", "a: 1\n---\n", "a: 1\n...\n# end\n"}) {
    EXPECT_EQ(parse_yaml(one, "x").find("a")->text, "1") << one;
  }
}

TEST(Yaml, MapsListsTextsAndAliases) {
  const YamlValue root = parse_yaml(
      "%YAML 1.1\n---\na: 5 # five\nb: &b [1, 'x y', ~]\nc: {d: *b, 'e f': \"\"}\n? g\n: h\n---\n", "x");
  ASSERT_EQ(root.kind, Kind::kMap);
  ASSERT_EQ(root.entries.size(), 4u);
  EXPECT_EQ(root.find("a")->text, "5");
  EXPECT_EQ(root.find("a")->line, 3);
  EXPECT_EQ(root.find("z"), nullptr);
  const YamlValue& list = *root.find("c")->find("d");
  ASSERT_EQ(list.items.size(), 3u);
  EXPECT_EQ(list.items[1].text, "x y");
  EXPECT_EQ(list.items[2].kind, Kind::kNothing);
  EXPECT_EQ(root.find("c")->find("e f")->kind, Kind::kText);
  EXPECT_EQ(root.find("g")->text, "h");
  EXPECT_EQ(parse_yaml("", "x").kind, Kind::kNothing);
  EXPECT_EQ(parse_yaml("\xef\xbb\xbf"
                       "a: 1",
                       "x")
                .find("a")
                ->text,
            "1");  // a byte order mark
}

/// 9^8 values in some hundred bytes.
std::string alias_bomb() {
  std::string text = "l0: &l0 [1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
  for (int i = 1; i < 9; ++i) {
    const std::string alias = "*l" + std::to_string(i - 1);
    text += "l" + std::to_string(i) + ": &l" + std::to_string(i) + " [" + alias;
    for (int k = 1; k < 9; ++k) text += ", " + alias;
    text += "]\n";
  }
  return text;
}

// Text quoted from a file may contain line ends.
TEST(Yaml, AProblemIsToldInOneLine) {
  TemporaryFolder folder;
  TrackerOptions options;
  for (const std::string& content :
       {std::string("seed: 11\0\n", 10), std::string("\"a\\nb\": {c: 1}\n"), std::string("seed: \"1\\n2\"\n"),
        std::string("image_width: \"1\\n2\"\n"), std::string("{\"a\\nb\": 1, \"a\\nb\": 2}\n")}) {
    const std::string path = folder.write("lines.yaml", content);
    const auto expect_one_line = [&](const auto& read) {
      try {
        read();
        ADD_FAILURE() << content << " is taken";
      } catch (const std::runtime_error& error) {
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      }
    };
    expect_one_line([&] { read_camera_yaml(path); });
    expect_one_line([&] { read_options_yaml(path, &options); });
  }
}

// Files that both readers of YAML files must refuse with one line that names the file.
TEST(Yaml, FilesThatAreMoreThanTheySeemAreRefused) {
  TemporaryFolder folder;
  TrackerOptions options;
  const auto expect = [&](const std::string& content, std::initializer_list<std::string> parts) {
    const std::string path = folder.write("bad.yaml", content);
    expect_error([&] { read_camera_yaml(path); }, {path, "expected"});
    expect_error([&] { read_camera_yaml(path); }, parts);
    expect_error([&] { read_options_yaml(path, &options); }, {path, "expected"});
    expect_error([&] { read_options_yaml(path, &options); }, parts);
  };
  expect("a: &a\n  b: *a\n", {"line 2", "alias of a value that contains"});
  expect("a: &a [*a]\n", {"line 1", "alias of a value that contains"});
  expect(alias_bomb(), {"line", "more than 20000 values"});
  expect(std::string(100000, '['), {"line 1"});
  expect("a: " + std::string(30, '[') + std::string(30, ']'), {"line 1", "nested"});
  std::string deep;
  for (int i = 0; i < 200; ++i) deep += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  expect(deep, {"nested"});
  expect("a: [" + std::string(300 * 1024, ' ') + "]", {"more than 262144 bytes"});
  expect("a: 1\nb: {c: 1, d: 2, c: 3}\n", {"line 2", "the key c a second time"});
  expect("a: 1\n? [1]\n: 2\n", {"line 2", "a key that is not a text"});
  expect("a: [1, 2", {"line", "not valid YAML"});
  for (const std::string& path : {std::string("/dev/zero"), folder.path()}) {
    expect_error([&] { read_camera_yaml(path); }, {path, "cannot be read"});
    expect_error([&] { read_options_yaml(path, &options); }, {path, "cannot be read"});
  }
}

}  // namespace
}  // namespace mono_pose_tracker
