// Whether these tests were built with sanitizers, which take memory and time of their own: gcc and clang tell it in different ways.
#pragma once

#ifdef __has_feature
#define RAYPAGER_HAS_FEATURE(feature) __has_feature(feature)
#else
#define RAYPAGER_HAS_FEATURE(feature) 0
#endif

#if defined(__SANITIZE_ADDRESS__) || RAYPAGER_HAS_FEATURE(address_sanitizer)
#define RAYPAGER_ADDRESS_SANITIZER 1
#else
#define RAYPAGER_ADDRESS_SANITIZER 0
#endif

#if defined(__SANITIZE_THREAD__) || RAYPAGER_HAS_FEATURE(thread_sanitizer)
#define RAYPAGER_THREAD_SANITIZER 1
#else
#define RAYPAGER_THREAD_SANITIZER 0
#endif
