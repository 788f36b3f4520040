#ifndef VISCOPADE_FLOAT
#if __VERSION__ >= 400 || (defined(GL_ES) && __VERSION__ >= 320)
#define VISCOPADE_FLOAT precise highp float // the order of evaluation for which rounding is proven
#else
#define VISCOPADE_FLOAT highp float
#endif
#endif
