-- What a job leaves when it ends: the absl::StatusCode of `reason`, and what its phases took (server/job/phases.h).
ALTER TABLE job ADD COLUMN code INTEGER NOT NULL DEFAULT 0;
ALTER TABLE job ADD COLUMN phases BLOB NOT NULL DEFAULT x'';
