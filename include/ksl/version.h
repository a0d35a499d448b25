/* KSL: the version of these headers: KSL_VERSION, a string, and KSL_VERSION_MAJOR, _MINOR, _PATCH, numbers.

   KSL_GIT_COMMIT and KSL_GIT_BRANCH are strings, too.  Nothing is read from a repository, so that one source gives one
   build wherever it lies.  Who builds a commit and wants it told defines them: -DKSL_GIT_COMMIT='"0123abc"'. */
#ifndef KSL_VERSION_H
#define KSL_VERSION_H

#include "ksl/config.h"

#ifndef KSL_GIT_COMMIT
#define KSL_GIT_COMMIT "unknown"
#endif
#ifndef KSL_GIT_BRANCH
#define KSL_GIT_BRANCH "unknown"
#endif

#endif
