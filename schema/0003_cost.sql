-- What tasks of a kind took over what the planner thought: run_ratio by the worker's clock, lease_ratio from lease to
-- result (server/job/learnt_costs.h).
CREATE TABLE cost(
  kind TEXT NOT NULL,
  code_version INTEGER NOT NULL,
  run_ratio REAL NOT NULL,
  lease_ratio REAL NOT NULL,
  samples INTEGER NOT NULL,
  PRIMARY KEY(kind, code_version)
) WITHOUT ROWID;
