-- The coordinator's memory. Times are microseconds since 1970 (UTC), digests and keys 32 raw bytes.

-- Numbers of the farm itself; `epoch` counts the coordinator's starts and forms the upper half of every fencing token.
CREATE TABLE meta(name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
INSERT INTO meta VALUES ('epoch', 0);

-- One row a submit. (user, client_key) makes a repeated submit the same job. state: 0 running, 1 done, 2 failed, 3 cancelled.
CREATE TABLE job(
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  user TEXT NOT NULL,
  client_key TEXT NOT NULL,
  name TEXT NOT NULL,
  state INTEGER NOT NULL,
  priority INTEGER NOT NULL,
  scene BLOB NOT NULL,
  settings BLOB NOT NULL,
  submitted_us INTEGER NOT NULL,
  finished_us INTEGER NOT NULL DEFAULT 0,
  reason TEXT NOT NULL DEFAULT '',
  tasks INTEGER NOT NULL DEFAULT 0,
  known_tasks INTEGER NOT NULL DEFAULT 0,
  run_us INTEGER NOT NULL DEFAULT 0,
  artifacts BLOB NOT NULL DEFAULT x'',
  UNIQUE(user, client_key)
);
CREATE INDEX job_by_state ON job(state, id);

-- A running job's task graph, as the planner gave it, one row a stage; gone when the job ends.
CREATE TABLE job_stage(
  job INTEGER NOT NULL,
  stage INTEGER NOT NULL,
  graph BLOB NOT NULL,
  PRIMARY KEY(job, stage)
) WITHOUT ROWID;

-- What is known: task key (plan key and action key alike) -> outputs. A key here is never run again.
CREATE TABLE catalogue(
  key BLOB PRIMARY KEY,
  outputs BLOB NOT NULL,
  run_us INTEGER NOT NULL,
  used_us INTEGER NOT NULL
) WITHOUT ROWID;
CREATE INDEX catalogue_by_use ON catalogue(used_us);

-- Blobs on disk. refs: rows of catalogue that name it, plus jobs whose scene it is.
CREATE TABLE blob(
  digest BLOB PRIMARY KEY,
  size_bytes INTEGER NOT NULL,
  refs INTEGER NOT NULL,
  touched_us INTEGER NOT NULL
) WITHOUT ROWID;
CREATE INDEX blob_unreferenced ON blob(touched_us) WHERE refs <= 0;

-- Bearer tokens by SHA-256. scopes: 1 submit, 2 work, 4 read, 8 admin. expires_us 0: never.
CREATE TABLE token(
  hash BLOB PRIMARY KEY,
  user TEXT NOT NULL,
  scopes INTEGER NOT NULL,
  created_us INTEGER NOT NULL,
  expires_us INTEGER NOT NULL
) WITHOUT ROWID;

-- Shares and limits of users that are not the default; 0: no limit.
CREATE TABLE account(
  user TEXT PRIMARY KEY,
  weight INTEGER NOT NULL,
  max_jobs INTEGER NOT NULL,
  max_scene_bytes INTEGER NOT NULL,
  max_tasks INTEGER NOT NULL
) WITHOUT ROWID;

-- Failed runs of tasks, for the jobs' reports and to restore who is excluded from what.
CREATE TABLE failure(
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  at_us INTEGER NOT NULL,
  job INTEGER NOT NULL,
  kind TEXT NOT NULL,
  key BLOB NOT NULL,
  worker TEXT NOT NULL,
  reason TEXT NOT NULL
);
CREATE INDEX failure_by_job ON failure(job);
