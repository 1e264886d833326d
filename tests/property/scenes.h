// Random scenes as SCN text, each from a seed alone: every class of object, every way an eye, a light and a scale can be unusual.
#ifndef SCN_TESTS_PROPERTY_SCENES_H
#define SCN_TESTS_PROPERTY_SCENES_H

#include <stdbool.h>
#include <stdint.h>

typedef enum SceneClass {
    SCENE_QUADRICS,   // one to four quadrics of any kind, transformed
    SCENE_DEGENERATE, // slabs, pairs of planes, cylinders and cones by their coefficients, cut to size
    SCENE_FREEFORM,   // a ball with bumps and dents
    SCENE_BASES,      // free forms on cones, hyperboloids, saddles, cylinders, slabs
    SCENE_SETS,       // set operations of quadrics, nested
    SCENE_FREE_SETS,  // set operations of free forms, deformed as a whole
    SCENE_EYE,        // the eye inside a support or inside an object
    SCENE_FAMILY,     // hundreds of perturbations or of leaves
    SCENE_FACES,      // faces that coincide
    SCENE_LIGHTS,     // lights behind, inside, near and at a distance of a million
    SCENE_MORPHS,     // morphs and keys of quadrics, free forms and sets, at rest and in motion, painted, cut, deformed
    SCENE_FIELDS, // general fields of random expressions, cut to size, moved and deformed, alone and in set operations
    SCENE_STEEP,  // narrow and strong perturbations seen from near: polynomials that are steep, flat, and nearly touch
    SCENE_OPERATIONS, // offsets, blends and warps of quadrics, sets and fields, copies, morphs of them
    SCENE_CLASSES
} SceneClass;

extern const char *const scene_class_names[SCENE_CLASSES];

typedef struct RandomScene {
    char *text;  // freed by the caller
    double size; // what lengths are measured by: objects reach about this far from the origin
} RandomScene;

RandomScene random_scene(SceneClass kind, uint64_t seed);

#endif
