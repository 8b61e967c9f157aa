#include "tools/cli/pass_groups.h"

#include <fmt/format.h>

#include <algorithm>

namespace halflight {

std::string_view group_of(std::string_view pass) {
    return pass.substr(0, pass.find(':'));
}

std::vector<PassGroup> pass_groups(std::span<const PassTime> passes) {
    std::vector<PassGroup> groups;
    double sum = 0;
    for (const PassTime& pass : passes) {
        const std::string_view name = group_of(pass.name);
        auto group = std::ranges::find(groups, name, &PassGroup::name);
        if (group == groups.end()) group = groups.insert(groups.end(), PassGroup{std::string(name)});
        ++group->passes;
        group->runs += pass.runs;
        group->seconds += pass.seconds;
        sum += pass.seconds;
    }
    for (PassGroup& group : groups) group.share = sum > 0 ? group.seconds / sum : 0;
    return groups;
}

std::string pass_table(std::span<const PassTime> passes) {
    const std::vector<PassGroup> groups = pass_groups(passes);
    PassGroup all{"all"};
    std::size_t width = 8;
    for (const PassGroup& group : groups) {
        width = std::max(width, group.name.size());
        all.passes += group.passes, all.runs += group.runs;
        all.seconds += group.seconds, all.share += group.share;
    }
    std::string table = fmt::format("{:<{}}  passes     runs  seconds  share\n", "group", width);
    const auto add = [&](const PassGroup& g) {
        table += fmt::format("{:<{}}  {:>6}  {:>7}  {:>7.3f}  {:>3.0f} %\n", g.name, width, g.passes, g.runs, g.seconds,
                             100 * g.share);
    };
    for (const PassGroup& group : groups) add(group);
    add(all);
    return table;
}

}  // namespace halflight
