// Lists of preview modes as they are asked for and told.
#include "passes/preview.h"

#include <gtest/gtest.h>

#include "tests/support/error_message.h"

namespace halflight {
namespace {

TEST(Preview, IsWhatItsTextSays) {
    for (const bool temporal : {false, true}) {
        for (const bool filter : {false, true}) {
            const Preview preview{.temporal = temporal, .filter = filter};
            EXPECT_EQ(preview_named(text(preview)), preview);
            EXPECT_EQ(preview.any(), temporal || filter);
        }
    }
    EXPECT_EQ(text({}), "none");
    EXPECT_EQ(text({.temporal = true, .filter = true}), "temporal,filter");
    EXPECT_EQ(preview_named("filter,temporal"), preview_named("temporal,filter"));
}

TEST(Preview, UnknownModesAreRefusedByName) {
    const auto message = [](const char* list) { return error_message([&] { preview_named(list); }); };
    EXPECT_EQ(message("blur"), "blur: 'blur' is no preview mode; there are: temporal, filter");
    EXPECT_EQ(message("filter,filter"), "filter,filter: 'filter' is given twice");
    for (const char* list : {"", "filter,", ",filter", "none,filter", "Filter", "filter "})
        EXPECT_NE(message(list), "") << list;
}

}  // namespace
}  // namespace halflight
