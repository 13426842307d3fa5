"""Priorities, limits and deadlines of jobs

Revision ID: 0004
Revises: 0003
"""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None

# What jobs of before get; later ones are always written with a value of their own.
GIVEN = {
    "priority": (sa.Integer(), "5"),
    "client": (sa.String(length=300), ""),
    "recoveries": (sa.Integer(), "0"),
    "worker": (sa.String(length=300), ""),
}
OPTIONAL = {
    "deadline_s": sa.Double(),
    "deadline_at": sa.DateTime(),
    "not_before": sa.DateTime(),
    "failed_step": sa.String(length=64),
}


def upgrade() -> None:
    with op.batch_alter_table("job", schema=None) as batch_op:
        for name, (kind, value) in GIVEN.items():
            batch_op.add_column(sa.Column(name, kind, nullable=False, server_default=value))
        for name, kind in OPTIONAL.items():
            batch_op.add_column(sa.Column(name, kind, nullable=True))
        batch_op.drop_index(batch_op.f("ix_job_status_dispatched_created_at"))
        batch_op.create_index(
            batch_op.f("ix_job_status_dispatched_priority_created_at"),
            ["status", "dispatched", "priority", "created_at"],
            unique=False,
        )
    with op.batch_alter_table("job", schema=None) as batch_op:
        for name, (kind, _) in GIVEN.items():
            batch_op.alter_column(name, existing_type=kind, server_default=None)

    op.create_table(
        "quarantine",
        sa.Column("key", sa.String(length=64), nullable=False),
        sa.Column("stage", sa.String(length=100), nullable=False),
        sa.Column("plugin", sa.String(length=300), nullable=True),
        sa.Column("times", sa.Integer(), nullable=False),
        sa.Column("detail", sa.Text(), nullable=False),
        sa.Column("created_at", sa.DateTime(), nullable=False),
        sa.PrimaryKeyConstraint("key", name=op.f("pk_quarantine")),
    )
    with op.batch_alter_table("quarantine", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_quarantine_created_at"), ["created_at"], unique=False)


def downgrade() -> None:
    with op.batch_alter_table("quarantine", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_quarantine_created_at"))
    op.drop_table("quarantine")

    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_job_status_dispatched_priority_created_at"))
        for name in (*GIVEN, *OPTIONAL):
            batch_op.drop_column(name)
        batch_op.create_index(
            batch_op.f("ix_job_status_dispatched_created_at"), ["status", "dispatched", "created_at"], unique=False
        )
