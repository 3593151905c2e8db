// Order of pixels: strips of four rows, each walked column by column, so that any few pixels in a row are a compact
// block and their rays and gathers stay together. src/render/session/pixels.rs is the host's copy.

const uint PIXEL_ROWS = 4u; /// Rows of pixels in a strip.

uvec2 pixel_position(uint index, uint width, uint height) {
    uint strip = index / (PIXEL_ROWS * width);
    uint rows = min(PIXEL_ROWS, height - strip * PIXEL_ROWS);
    uint inside = index - strip * PIXEL_ROWS * width;
    return uvec2(inside / rows, strip * PIXEL_ROWS + inside % rows);
}

// Index of the pixel in this column and row: the inverse of pixel_position.
uint pixel_index(uvec2 at, uint width, uint height) {
    uint strip = at.y / PIXEL_ROWS;
    uint rows = min(PIXEL_ROWS, height - strip * PIXEL_ROWS);
    return strip * PIXEL_ROWS * width + at.x * rows + at.y % PIXEL_ROWS;
}

// Key of a path slot for random numbers: the same whatever the bands and however many slots a pixel has.
uint slot_key(uint slot, Camera c) {
    return hash2(c.first_pixel + slot % c.pixels, slot / c.pixels);
}
