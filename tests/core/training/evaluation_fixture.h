// The real generator on small data and the real pipeline with untrained networks, made once per process.
#pragma once

#include "core/training/character_generator.h"
#include "core/transfer/pipeline.h"

namespace stance::testing {

const CharacterGenerator& SmallGenerator();
const Pipeline& UntrainedPipeline();

}  // namespace stance::testing
