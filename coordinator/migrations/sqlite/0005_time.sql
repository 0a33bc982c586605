-- Frames that show the same are one moment. `moments` lists the frame after each moment's last one (u32, little-endian, in order; NULL: each
-- frame is a moment). What a frame's row and its files say holds for the moment at that position.
ALTER TABLE jobs ADD COLUMN moments BLOB CHECK (length(moments) > 0 AND length(moments) % 4 = 0);

-- A paused job gets no leases.
ALTER TABLE jobs ADD COLUMN paused INTEGER NOT NULL DEFAULT 0 CHECK (paused IN (0, 1));

-- Windows of moments that were solved together: how that went, and what each window says of each of its moments, in their order.
CREATE TABLE windows (
    job         BLOB    NOT NULL REFERENCES jobs (id),
    number      INTEGER NOT NULL,
    stitch      REAL    NOT NULL,
    reconstruct REAL    NOT NULL,
    alpha       REAL    NOT NULL,
    iterations  INTEGER NOT NULL,
    residual    REAL    NOT NULL,
    PRIMARY KEY (job, number)
) STRICT, WITHOUT ROWID;

CREATE TABLE shares (
    job    BLOB    NOT NULL,
    number INTEGER NOT NULL,
    place  INTEGER NOT NULL,
    blob   BLOB    NOT NULL CHECK (length(blob) = 32),
    size   INTEGER NOT NULL,
    PRIMARY KEY (job, number, place),
    FOREIGN KEY (job, number) REFERENCES windows (job, number)
) STRICT, WITHOUT ROWID;
