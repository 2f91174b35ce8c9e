// project.cl: world -> eye space and screen (paper 2.1, step 1).
// One work-item per particle; the range and the buffers are padded to whole work-groups.
kernel void project_particles(global const float* x,       // [n] world position minus `origin`
                              global const float* y,       //     ... world units
                              global const float* z,
                              global const float* radius,  // [n] radius over the common radius
                              global float* eye,           // [3][n_padded] eye space, radii
                              const int n) {
  eye[get_global_id(0)] = x[get_global_id(0)];
}
