#include "client/answers.h"

#include "core/skeleton/skeleton.h"

namespace stance {

void NameBones(BoneNaming naming, JointTree* joints) {
  if (joints->names == HumanSkeleton().names()) joints->names = HumanBoneNames(naming);
}

}  // namespace stance
