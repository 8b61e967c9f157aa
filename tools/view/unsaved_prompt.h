// The question whether edits are to be saved before they would be lost.
#pragma once

#include <functional>
#include <string>

namespace halflight::view {

/// A modal question with three answers: save the edits, discard them, or stay.
class UnsavedPrompt {
  public:
    /// Asks before f is called. question: complete sentences; file: name of the file that would be written.
    void ask(std::string question, std::string file, std::function<void()> f);
    bool asking() const { return static_cast<bool>(then_); }
    enum class Answer { none, save, discard, cancel };
    /// Declares the question while it is open. After save and discard, proceed() does what was asked about.
    Answer declare();
    void proceed();
    void cancel() { then_ = {}; }

  private:
    std::string question_, file_;
    std::function<void()> then_;  // what was asked about; null: nothing is being asked
};

}  // namespace halflight::view
