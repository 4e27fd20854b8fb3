#include "core/transfer/model_folders.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "core/base/files.h"

namespace stance {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class ModelFoldersTest : public ::testing::Test {
 protected:
  ModelFoldersTest()
      : root_(fs::path(::testing::TempDir()) / ("model-folders-" + std::to_string(getpid()))) {}
  ~ModelFoldersTest() override { fs::remove_all(root_); }

  void Put(const std::string& folder, const std::string& version) const {
    fs::create_directories(root_ / folder);
    std::ofstream(root_ / folder / "manifest.json")
        << R"({"format_version": 1, "name": "one", "version": ")" << version
        << R"(", "method": "stance", "skeleton": "human24", "samples": 512, "max_ring": 12, "weights": "w", )"
        << R"("crc32": "0"})";
  }
  std::vector<std::string> Found(const VersionPins& pins = {}) const { return Relative(Find(pins).models); }
  ModelFolders Find(const VersionPins& pins = {}) const {
    const auto found = FindModelFolders({root_}, pins);
    EXPECT_TRUE(found.ok()) << found.status();
    return found.value_or(ModelFolders{});
  }
  std::string ErrorOf(const VersionPins& pins, absl::StatusCode code) const {
    const auto found = FindModelFolders({root_}, pins);
    EXPECT_EQ(found.status().code(), code);
    return std::string(found.status().message());
  }
  std::vector<std::string> Relative(const std::vector<fs::path>& folders) const {
    std::vector<std::string> names;
    for (const fs::path& folder : folders) names.push_back(folder.lexically_relative(root_).string());
    return names;
  }

  const fs::path root_;
};

TEST_F(ModelFoldersTest, TakesFlatModelsAndTheHighestVersionOfOthers) {
  Put("one/2", "2");
  Put("one/10", "10");
  Put("one/9", "9");
  Put("one/11.aside", "11");
  Put("one/012", "012");
  Put("two", "any text");
  fs::create_directories(root_ / "notes");
  EXPECT_THAT(Found(), ElementsAre("one/10", "two"));
}

TEST_F(ModelFoldersTest, TakesThePinnedVersion) {
  Put("one/2", "2");
  Put("one/10", "10");
  EXPECT_THAT(Found({{"one", 2}}), ElementsAre("one/2"));
  EXPECT_THAT(ErrorOf({{"one", 3}}, absl::StatusCode::kNotFound), HasSubstr("no complete version 3"));
  EXPECT_THAT(ErrorOf({{"two", 1}}, absl::StatusCode::kNotFound), HasSubstr("'two'"));
}

TEST_F(ModelFoldersTest, SkipsAVersionThatIsHalfWritten) {
  Put("one/2", "2");
  fs::create_directories(root_ / "one/3");
  std::ofstream(root_ / "one/3/weights.safetensors") << "the first half";
  const ModelFolders found = Find();
  EXPECT_THAT(Relative(found.models), ElementsAre("one/2"));
  EXPECT_THAT(Relative(found.skipped), ElementsAre("one/3"));
  EXPECT_THAT(ErrorOf({{"one", 3}}, absl::StatusCode::kNotFound), HasSubstr("no complete version 3"));
}

TEST_F(ModelFoldersTest, AModelsOwnFolderIsTakenToo) {
  Put("flat", "any");
  Put("versions/4", "4");
  const auto found = FindModelFolders({root_ / "flat", root_ / "versions" / ""}, {{"versions", 4}});
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_THAT(found->models, ElementsAre(root_ / "flat", root_ / "versions" / "4"));
}

TEST_F(ModelFoldersTest, AFolderWithoutModelsStandsForItself) {
  fs::create_directories(root_ / "one/1");
  const ModelFolders found = Find();
  EXPECT_THAT(found.models, ElementsAre(root_));
  EXPECT_THAT(Relative(found.skipped), ElementsAre("one/1"));
}

TEST_F(ModelFoldersTest, RefusesWhatCouldBeTakenForAnother) {
  Put("one/2", "3");
  EXPECT_THAT(ErrorOf({}, absl::StatusCode::kInvalidArgument), HasSubstr("version is '3'"));
  Put("one/2", "2");
  Put("one", "1");
  EXPECT_THAT(ErrorOf({}, absl::StatusCode::kInvalidArgument), HasSubstr("beside versions such as 2"));
}

TEST_F(ModelFoldersTest, TheStampTellsStatesApart) {
  Put("one", "1");
  const std::string before = StampOf({root_ / "one"});
  EXPECT_EQ(StampOf({root_ / "one"}), before);
  ASSERT_TRUE(WriteFile(root_ / "one" / "weights", "bytes").ok());
  const std::string after = StampOf({root_ / "one"});
  EXPECT_NE(after, before);
  fs::last_write_time(root_ / "one" / "weights", fs::file_time_type::clock::now() + std::chrono::hours(1));
  EXPECT_NE(StampOf({root_ / "one"}), after);
  EXPECT_NE(StampOf({}), before);
  // A folder that is missing has one, too: a state like any other.
  EXPECT_NE(StampOf({root_ / "none"}), "");
}

}  // namespace
}  // namespace stance
