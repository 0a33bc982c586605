-- Jobs and what becomes of them: the tables of `migrations/sqlite` up to 0005, in PostgreSQL's types. Times are milliseconds since
-- 1970, digests and UUIDs are their bytes. Rows that change often leave room on their pages, so that changing them touches no index.

CREATE TABLE jobs (
    id           BYTEA  NOT NULL PRIMARY KEY CHECK (length(id) = 16),
    name         TEXT   NOT NULL,
    priority     BIGINT NOT NULL,
    created      BIGINT NOT NULL,
    client_token TEXT   UNIQUE,
    scene        BYTEA  NOT NULL CHECK (length(scene) = 32),
    plan         BYTEA  NOT NULL,
    tile         BIGINT NOT NULL CHECK (tile > 0),
    first_frame  BIGINT NOT NULL,
    frame_count  BIGINT NOT NULL CHECK (frame_count > 0),
    state        TEXT   NOT NULL CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled')),
    error        TEXT,
    started      BIGINT,
    finished     BIGINT,
    moments      BYTEA  CHECK (length(moments) > 0 AND length(moments) % 4 = 0),
    paused       BIGINT NOT NULL DEFAULT 0 CHECK (paused IN (0, 1))
);

CREATE TABLE frames (
    job              BYTEA            NOT NULL REFERENCES jobs (id),
    position         BIGINT           NOT NULL,
    state            TEXT             NOT NULL CHECK (state IN ('waiting', 'rendering', 'assembling', 'done')),
    started          BIGINT,
    units            BIGINT           NOT NULL,
    samples          BIGINT           NOT NULL,
    load             DOUBLE PRECISION NOT NULL,
    compile          DOUBLE PRECISION NOT NULL,
    render           DOUBLE PRECISION NOT NULL,
    render_span      DOUBLE PRECISION NOT NULL,
    stitch           DOUBLE PRECISION NOT NULL,
    reconstruct      DOUBLE PRECISION NOT NULL,
    write            DOUBLE PRECISION NOT NULL,
    estimated_relmse DOUBLE PRECISION,
    statistics       BYTEA            NOT NULL,
    goal             BIGINT           CHECK (goal > 0),
    stopped          TEXT             CHECK (stopped IN ('error', 'seconds', 'samples')),
    choice           TEXT,
    PRIMARY KEY (job, position)
);

CREATE TABLE points (
    job           BYTEA            NOT NULL,
    position      BIGINT           NOT NULL,
    samples       BIGINT           NOT NULL CHECK (samples > 0),
    cpu_seconds   DOUBLE PRECISION NOT NULL,
    wall_seconds  DOUBLE PRECISION NOT NULL,
    check_seconds DOUBLE PRECISION NOT NULL,
    relmse        DOUBLE PRECISION NOT NULL,
    low           DOUBLE PRECISION NOT NULL,
    high          DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (job, position, samples),
    FOREIGN KEY (job, position) REFERENCES frames (job, position)
);

CREATE TABLE files (
    job      BYTEA  NOT NULL REFERENCES jobs (id),
    position BIGINT NOT NULL,
    kind     TEXT   NOT NULL CHECK (kind IN ('exr', 'png', 'json')),
    blob     BYTEA  NOT NULL CHECK (length(blob) = 32),
    size     BIGINT NOT NULL,
    PRIMARY KEY (job, position, kind)
);

-- A unit has a row from its first lease on. Without one it is ready and its epoch is 0.
CREATE TABLE units (
    job      BYTEA  NOT NULL REFERENCES jobs (id),
    unit     BIGINT NOT NULL,
    epoch    BIGINT NOT NULL CHECK (epoch > 0),
    failures BIGINT NOT NULL DEFAULT 0,
    losses   BIGINT NOT NULL DEFAULT 0,
    PRIMARY KEY (job, unit)
) WITH (fillfactor = 80);

CREATE TABLE leases (
    job     BYTEA  NOT NULL,
    unit    BIGINT NOT NULL,
    worker  BYTEA  NOT NULL CHECK (length(worker) = 16),
    granted BIGINT NOT NULL,
    PRIMARY KEY (job, unit),
    FOREIGN KEY (job, unit) REFERENCES units (job, unit)
);

-- Written once for each unit, never changed: the primary key refuses a second one.
CREATE TABLE results (
    job     BYTEA            NOT NULL,
    unit    BIGINT           NOT NULL,
    epoch   BIGINT           NOT NULL,
    content BYTEA            NOT NULL CHECK (length(content) = 32),
    blob    BYTEA            NOT NULL CHECK (length(blob) = 32),
    size    BIGINT           NOT NULL,
    load    DOUBLE PRECISION NOT NULL,
    compile DOUBLE PRECISION NOT NULL,
    render  DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (job, unit),
    FOREIGN KEY (job, unit) REFERENCES units (job, unit)
);

-- Every worker process that ever connected, for people.
CREATE TABLE workers (
    id        BYTEA  NOT NULL PRIMARY KEY CHECK (length(id) = 16),
    name      TEXT   NOT NULL,
    version   TEXT   NOT NULL,
    threads   BIGINT NOT NULL,
    connected BIGINT NOT NULL
);

-- Windows of moments that were solved together.
CREATE TABLE windows (
    job         BYTEA            NOT NULL REFERENCES jobs (id),
    number      BIGINT           NOT NULL,
    stitch      DOUBLE PRECISION NOT NULL,
    reconstruct DOUBLE PRECISION NOT NULL,
    alpha       DOUBLE PRECISION NOT NULL,
    iterations  BIGINT           NOT NULL,
    residual    DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (job, number)
);

CREATE TABLE shares (
    job    BYTEA  NOT NULL,
    number BIGINT NOT NULL,
    place  BIGINT NOT NULL,
    blob   BYTEA  NOT NULL CHECK (length(blob) = 32),
    size   BIGINT NOT NULL,
    PRIMARY KEY (job, number, place),
    FOREIGN KEY (job, number) REFERENCES windows (job, number)
);
