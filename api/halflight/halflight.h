// Halflight as a library: loads scenes, renders pictures and sequences, writes files. No header here includes OpenGL.
//
//     halflight::LoadedScene scene({.scene = "room.glb"});
//     halflight::RenderSettings settings;
//     settings.aovs = {"albedo"};
//     halflight::FrameRenderer renderer(scene, settings);
//     const halflight::RenderResult picture = renderer.render();
//     write_picture("room.exr", picture, picture_info(renderer, picture, {}, ""));
//
// Errors are exceptions of class halflight::Error whose what() is one line. The library neither prints nor exits.
// Objects belong to one thread at a time.
#pragma once

#include "api/halflight/camera.h"
#include "api/halflight/camera_pose.h"
#include "api/halflight/edit_keys.h"
#include "api/halflight/edit_text.h"
#include "api/halflight/environment_choice.h"
#include "api/halflight/frame_names.h"
#include "api/halflight/frame_renderer.h"
#include "api/halflight/loaded_scene.h"
#include "api/halflight/log.h"
#include "api/halflight/movie.h"
#include "api/halflight/pack.h"
#include "api/halflight/picture_file.h"
#include "api/halflight/scene_edits.h"
#include "api/halflight/sequence.h"
#include "api/halflight/settings_file.h"
#include "api/halflight/statistics.h"
#include "engine/core/error.h"
#include "engine/core/frames.h"
#include "engine/core/memory_ledger.h"
#include "engine/settings/layers.h"
#include "engine/settings/render_settings.h"
#include "engine/settings/settings_table.h"
