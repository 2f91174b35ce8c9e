// All of the library.
#pragma once

#include "meniscus/borrowed.hpp"
#include "meniscus/camera.hpp"
#include "meniscus/closed.hpp"
#include "meniscus/device.hpp"
#include "meniscus/error.hpp"
#include "meniscus/extract.hpp"
#include "meniscus/io.hpp"
#include "meniscus/motion.hpp"
#include "meniscus/named_parameters.hpp"
#include "meniscus/notice.hpp"
#include "meniscus/parameters.hpp"
#include "meniscus/session.hpp"
#include "meniscus/source.hpp"
#include "meniscus/types.hpp"
#include "meniscus/version.hpp"
#include "meniscus/whitewater.hpp"
