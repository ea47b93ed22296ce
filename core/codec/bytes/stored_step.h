// Quantiser steps as a file holds them.
#pragma once

namespace rilievo {

// Steps are written with 12 binary digits after the first: the nearest such number, which a
// position step has to be to come back as it was.
double StoredStep(double step);

}  // namespace rilievo
