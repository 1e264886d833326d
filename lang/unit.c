#include "lang/unit.h"

void unit_init(Unit *unit)
{
    *unit = (Unit){0};
    unit->sources.arena = &unit->arena;
    unit->names.arena = &unit->arena;
}

void unit_release(Unit *unit)
{
    arena_release(&unit->tree_arena);
    arena_release(&unit->arena);
    *unit = (Unit){0};
}
