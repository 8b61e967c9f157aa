// Tests editing in the viewer's session: undo and redo, selection, outlines, environments, variants.
#include <gtest/gtest.h>

#include "api/halflight/edit_text.h"
#include "tests/support/error_message.h"
#include "tests/support/process.h"
#include "tests/support/scenes.h"
#include "tools/view/edit_history.h"
#include "tools/view/session.h"

namespace halflight::view {
namespace {

constexpr ivec2 kSize(512, 512);

class ViewEdits : public testing::Test {
  protected:
    static PreviewArguments cornell() {
        PreviewArguments a;
        a.scene = std::string(HALFLIGHT_SOURCE_DIR) + "/scenes/cornell.glb";
        a.quiet = true;
        return a;
    }
    void edit(void (*add)(SceneEdits&, const std::string&, const std::string&), const char* text) {
        SceneEdits edits = session.edits;
        add(edits, "test", text);
        session.edit(edits);
    }

    Session session{cornell(), ColorConfig::load()};
};

TEST_F(ViewEdits, UndoAndRedoRestoreEachEdit) {
    session.transform.exposure = 0.5f;  // a value that metering has found
    EditHistory history;
    history.start(session.document());
    std::vector<SavedSettings> states = {session.document()};
    const auto done = [&] {
        history.record(session.document(), false);
        states.push_back(session.document());
    };
    edit(add_material_edit, "white.roughness=0.25");
    done();
    edit(add_node_edit, "tall block=translate:0.1,0,0");
    done();
    session.transform.exposure = 2.0f;
    done();
    session.bounces = 3;
    done();
    session.bookmark();
    done();
    EXPECT_TRUE(history.unsaved());
    for (std::size_t i = states.size() - 1; i-- > 0;) {
        ASSERT_TRUE(history.can_undo());
        EXPECT_FALSE(session.restore(*history.undo())) << "neither environment nor variant changes";
        EXPECT_EQ(session.document(), states[i]) << i;
        history.record(session.document(), false);  // a restored state is no edit
    }
    EXPECT_FALSE(history.can_undo());
    EXPECT_FALSE(history.undo());
    EXPECT_FALSE(history.unsaved());
    for (std::size_t i = 1; i < states.size(); ++i) {
        ASSERT_TRUE(history.can_redo());
        session.restore(*history.redo());
        EXPECT_EQ(session.document(), states[i]) << i;
    }
    EXPECT_FALSE(history.redo());
    history.mark_saved(session.document());
    EXPECT_FALSE(history.unsaved());
    session.restore(*history.undo());
    EXPECT_TRUE(history.unsaved());
    edit(add_hidden, "light");
    history.record(session.document(), false);
    EXPECT_FALSE(history.can_redo()) << "another edit ends the undone ones";
}

TEST_F(ViewEdits, DragsAreOneEditAndCamerasAreNone) {
    EditHistory history;
    history.start(session.document());
    for (const float factor : {1.5f, 2.0f, 2.5f}) {
        session.edits.emission = factor;
        history.record(session.document(), true);
    }
    EXPECT_FALSE(history.can_undo()) << "the mouse is still held";
    history.record(session.document(), false);
    session.move(orbit(session.pose(), {0.3, 0.1}));
    history.record(session.document(), false);
    session.restore(*history.undo());
    EXPECT_EQ(session.edits.emission, 1);
    EXPECT_FALSE(history.can_undo());
}

TEST_F(ViewEdits, MeteringIsNoEdit) {
    session.transform.exposure = {};
    ASSERT_TRUE(session.transform.metered());
    EditHistory history;
    history.start(session.document());
    session.transform.exposure = -3.0f;
    history.record(session.document(), false);
    EXPECT_FALSE(history.can_undo());
    EXPECT_FALSE(history.unsaved());
    session.transform.exposure = 1.0f;
    history.record(session.document(), false);
    EXPECT_TRUE(history.can_undo());
}

TEST_F(ViewEdits, InvalidEditsChangeNothing) {
    const SavedSettings before = session.document();
    SceneEdits edits;
    add_node_edit(edits, "test", "tal block=scale:2");
    EXPECT_NE(error_message([&] { session.edit(edits); }).find("did you mean 'tall block'?"), std::string::npos);
    EXPECT_EQ(session.document(), before);
}

TEST_F(ViewEdits, EnvironmentsAreChosenAndUndone) {
    const Environment own = session.scene().environment;
    EditHistory history;
    history.start(session.document());
    session.open(session.lighting(SkyPreset::studio)());
    EXPECT_GT(session.scene().environment.map.width, 0);
    EXPECT_EQ(session.environment(), EnvironmentChoice(SkyPreset::studio));
    history.record(session.document(), false);
    const CameraPose pose = session.pose();
    session.open(session.lighting(ClearSky{30, 120})());
    EXPECT_EQ(session.scene().lights.size(), 1u) << "the sun";
    history.record(session.document(), false);
    auto undone = session.restore(*history.undo());
    ASSERT_TRUE(undone);
    session.open((*undone)());
    EXPECT_EQ(session.environment(), EnvironmentChoice(SkyPreset::studio));
    EXPECT_TRUE(session.scene().lights.empty());
    undone = session.restore(*history.undo());
    ASSERT_TRUE(undone);
    session.open((*undone)());
    EXPECT_EQ(session.scene().environment.color, own.color);
    EXPECT_EQ(session.scene().environment.map.width, own.map.width);
    EXPECT_EQ(session.pose(), pose);
}

}  // namespace
}  // namespace halflight::view
