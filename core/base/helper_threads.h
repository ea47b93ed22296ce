// Threads that wait for work to help with, shared by the whole process.
#pragma once

#include <functional>

namespace rilievo {

// Asks up to `helpers` threads to call `help`, each once, soon or never: whoever offers work must
// be able to do all of it. Threads are started when they are first needed and kept. `help` may be
// called after the work is done, must not throw and must not wait for offers that
// nobody took.
void OfferWork(int helpers, std::function<void()> help);

// The calling thread helps with what is offered until `done`, which is asked under a lock: it must
// be quick, not throw, and not offer work. Whoever makes it true calls NudgeHelpers() then.
void HelpUntil(const std::function<bool()>& done);
void NudgeHelpers();

}  // namespace rilievo
