// Defines a macro, for defined_twice.cl.

#define REACH 3.0f
