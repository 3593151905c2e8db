// Order of pixels: strips of four rows, each walked column by column, so that any few pixels in a row are a compact
// block and their rays and gathers stay together. src/render/session/pixels.rs is the host's copy.
uvec2 pixel_position(uint index, uint width, uint height) {
    const uint ROWS = 4u;
    uint strip = index / (ROWS * width);
    uint rows = min(ROWS, height - strip * ROWS);
    uint inside = index - strip * ROWS * width;
    return uvec2(inside / rows, strip * ROWS + inside % rows);
}

// Index of the pixel in this column and row: the inverse of pixel_position.
uint pixel_index(uvec2 at, uint width, uint height) {
    const uint ROWS = 4u;
    uint strip = at.y / ROWS;
    uint rows = min(ROWS, height - strip * ROWS);
    return strip * ROWS * width + at.x * rows + at.y % ROWS;
}

// Key of a path slot for random numbers: the same whatever the bands and however many slots a pixel has.
uint slot_key(uint slot, Camera c) {
    return hash2(c.first_pixel + slot % c.pixels, slot / c.pixels);
}
