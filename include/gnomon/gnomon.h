// gnomon: everything a renderer needs, in one include.
#pragma once

#include "gnomon/auto.h"
#include "gnomon/blend.h"
#include "gnomon/block.h"
#include "gnomon/camera.h"
#include "gnomon/cast.h"
#include "gnomon/error.h"
#include "gnomon/keep.h"
#include "gnomon/lloyd.h"
#include "gnomon/lspsm.h"
#include "gnomon/lookup.h"
#include "gnomon/pssm.h"
#include "gnomon/samples.h"
#include "gnomon/sdsm.h"
#include "gnomon/types.h"
