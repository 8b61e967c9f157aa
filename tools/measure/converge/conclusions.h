// Conclusions of a report in sentences, and the explanation of its methods.
#pragma once

#include <string>
#include <vector>

#include "tools/measure/converge/measure.h"
#include "tools/measure/converge/report.h"

namespace halflight::converge {

/// A sentence with a label in front. style: "fine", "open" or "flag", as in page.cpp; empty: none.
struct Conclusion {
    std::string label, text;
    const char* style = "";
};

/// Returns the methods by their pictures: those of an entry make the same, bit for bit.
std::vector<std::vector<const MethodResult*>> methods_of_same_pictures(const Measurement& measured);
/// Returns the names of methods that make the same pictures, such as "Halflight (plain) = Halflight (native)".
std::string names_of(const std::vector<const MethodResult*>& methods);

/// Returns what the measurement shows: first whether renderers agree, then the answer to "which method?". Findings
/// about pictures are told once for all methods that make them. A slope that one of these methods leaves open is not
/// told if another one settles it.
std::vector<Conclusion> conclusions(const Subject& subject, const Measurement& measured);

/// Returns what a method does, in a sentence.
std::string explanation(Method method);

}  // namespace halflight::converge
