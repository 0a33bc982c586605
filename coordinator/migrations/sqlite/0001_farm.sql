-- Jobs and what becomes of them. Times are milliseconds since 1970, digests and UUIDs are their bytes.

CREATE TABLE jobs (
    id           BLOB    NOT NULL PRIMARY KEY CHECK (length(id) = 16),
    name         TEXT    NOT NULL,
    priority     INTEGER NOT NULL,
    created      INTEGER NOT NULL,
    client_token TEXT    UNIQUE,
    scene        BLOB    NOT NULL CHECK (length(scene) = 32),
    plan         BLOB    NOT NULL,
    tile         INTEGER NOT NULL CHECK (tile > 0),
    first_frame  INTEGER NOT NULL,
    frame_count  INTEGER NOT NULL CHECK (frame_count > 0),
    state        TEXT    NOT NULL CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled')),
    error        TEXT,
    started      INTEGER,
    finished     INTEGER
) STRICT, WITHOUT ROWID;

CREATE TABLE frames (
    job              BLOB    NOT NULL REFERENCES jobs (id),
    position         INTEGER NOT NULL,
    state            TEXT    NOT NULL CHECK (state IN ('waiting', 'rendering', 'assembling', 'done')),
    started          INTEGER,
    units            INTEGER NOT NULL,
    samples          INTEGER NOT NULL,
    load             REAL    NOT NULL,
    compile          REAL    NOT NULL,
    render           REAL    NOT NULL,
    render_span      REAL    NOT NULL,
    stitch           REAL    NOT NULL,
    reconstruct      REAL    NOT NULL,
    write            REAL    NOT NULL,
    estimated_relmse REAL,
    statistics       BLOB    NOT NULL,
    PRIMARY KEY (job, position)
) STRICT, WITHOUT ROWID;

CREATE TABLE files (
    job      BLOB    NOT NULL REFERENCES jobs (id),
    position INTEGER NOT NULL,
    kind     TEXT    NOT NULL CHECK (kind IN ('exr', 'png')),
    blob     BLOB    NOT NULL CHECK (length(blob) = 32),
    size     INTEGER NOT NULL,
    PRIMARY KEY (job, position, kind)
) STRICT, WITHOUT ROWID;

-- A unit has a row from its first lease on. Without one it is ready and its epoch is 0.
CREATE TABLE units (
    job      BLOB    NOT NULL REFERENCES jobs (id),
    unit     INTEGER NOT NULL,
    epoch    INTEGER NOT NULL CHECK (epoch > 0),
    failures INTEGER NOT NULL DEFAULT 0,
    losses   INTEGER NOT NULL DEFAULT 0,
    PRIMARY KEY (job, unit)
) STRICT, WITHOUT ROWID;

CREATE TABLE leases (
    job     BLOB    NOT NULL,
    unit    INTEGER NOT NULL,
    worker  BLOB    NOT NULL CHECK (length(worker) = 16),
    granted INTEGER NOT NULL,
    PRIMARY KEY (job, unit),
    FOREIGN KEY (job, unit) REFERENCES units (job, unit)
) STRICT, WITHOUT ROWID;

-- Written once for each unit, never changed: the primary key refuses a second one.
CREATE TABLE results (
    job     BLOB    NOT NULL,
    unit    INTEGER NOT NULL,
    epoch   INTEGER NOT NULL,
    content BLOB    NOT NULL CHECK (length(content) = 32),
    blob    BLOB    NOT NULL CHECK (length(blob) = 32),
    size    INTEGER NOT NULL,
    load    REAL    NOT NULL,
    compile REAL    NOT NULL,
    render  REAL    NOT NULL,
    PRIMARY KEY (job, unit),
    FOREIGN KEY (job, unit) REFERENCES units (job, unit)
) STRICT, WITHOUT ROWID;

-- Every worker process that ever connected, for people.
CREATE TABLE workers (
    id        BLOB    NOT NULL PRIMARY KEY CHECK (length(id) = 16),
    name      TEXT    NOT NULL,
    version   TEXT    NOT NULL,
    threads   INTEGER NOT NULL,
    connected INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
