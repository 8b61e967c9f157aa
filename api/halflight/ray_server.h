// Ray servers of callers: classes derived from rays::BatchServer, which trace all ray batches of a FrameRenderer
// (RendererOptions::ray_server). Unlike halflight.h, this header includes OpenGL: a server adds passes of its own to
// the frame graph. tests/pass/rays/test_tracer_rules.cpp states the rules for hits.
#pragma once

#include "api/halflight/frame_renderer.h"
#include "engine/rays/batch_server.h"
