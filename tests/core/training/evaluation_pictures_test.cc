#include "core/training/evaluation_pictures.h"

#include <gtest/gtest.h>

#include "tests/core/training/stick_character.h"

namespace stance {
namespace {

// A stick character transferred to its own pose.
struct OwnPose {
  Character character = testing::StickCharacter();
  TransferResult result;

  OwnPose() {
    result.target = character.mesh;
    result.source_rig = {character.joints, character.weights};
    result.reference_rig.joints = character.joints;
    result.target_joints = character.joints;
  }

  Image Render(const Points* truth, const PictureOptions& options) const {
    return RenderTransfer(character.mesh, character.mesh, result, truth, character.stature, options);
  }
};

PictureOptions SmallPictures() {
  PictureOptions options;
  options.render.tile_width = 100;
  options.render.tile_height = 140;
  return options;
}

TEST(RenderTransfer, ThreeTilesWithoutATruthAndFiveWithOne) {
  const OwnPose own;
  EXPECT_EQ(own.Render(nullptr, SmallPictures()).width, 300);
  const Image image = own.Render(&own.character.mesh.positions, SmallPictures());
  EXPECT_EQ(image.width, 500);
  EXPECT_EQ(image.height, 140);
}

TEST(RenderTransfer, SkeletonsAndWeightsChangeThePicture) {
  const OwnPose own;
  PictureOptions options = SmallPictures();
  const Image plain = own.Render(nullptr, options);
  options.skeletons = true;
  const Image skeletons = own.Render(nullptr, options);
  EXPECT_NE(skeletons.rgb, plain.rgb);
  options.weights = true;
  EXPECT_NE(own.Render(nullptr, options).rgb, skeletons.rgb);
}

// The same character with z up, said to be z up, gives the same picture.
TEST(RenderTransfer, StandsUprightWhicheverAxisIsUp) {
  OwnPose y_up, z_up;
  const auto turn = [](Points& points) {  // y -> z, z -> -y
    points.col(1).swap(points.col(2));
    points.col(1) = -points.col(1);
  };
  for (Points* points :
       {&z_up.character.mesh.positions, &z_up.result.target.positions, &z_up.result.source_rig.joints,
        &z_up.result.reference_rig.joints, &z_up.result.target_joints}) {
    turn(*points);
  }
  PictureOptions options = SmallPictures();
  options.skeletons = true;
  const Image expected = y_up.Render(nullptr, options);
  options.source_up = options.reference_up = UpAxis::kZ;
  EXPECT_EQ(z_up.Render(nullptr, options).rgb, expected.rgb);
}

}  // namespace
}  // namespace stance
