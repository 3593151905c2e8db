// Index of this invocation in a one-dimensional problem. The host spreads groups over x and y beyond 65,535, the
// smallest limit that Vulkan guarantees along one axis.
uint linear_group() {
    return gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
}

// A macro, because gl_WorkGroupSize in a function before `layout(local_size_x = ...) in;` silently compiles to 1.
#define linear_id() (linear_group() * gl_WorkGroupSize.x + gl_LocalInvocationID.x)
