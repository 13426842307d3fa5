"""Deliveries and secrets of webhooks, durations of steps, and the trace that a job belongs to

Revision ID: 0006
Revises: 0005
"""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

_NOW = (  # columns of `webhook` that rows of earlier versions get a value for
    sa.Column("enabled", sa.Boolean(), nullable=False, server_default=sa.true()),
    sa.Column("disabled_reason", sa.Text(), nullable=False, server_default=""),
)


def upgrade() -> None:
    with op.batch_alter_table("webhook", schema=None) as batch_op:
        for column in _NOW:
            batch_op.add_column(column)
        batch_op.add_column(sa.Column("old_secret", sa.String(length=100), nullable=True))
        batch_op.add_column(sa.Column("old_secret_expires_at", sa.DateTime(), nullable=True))
        batch_op.add_column(sa.Column("failing_since", sa.DateTime(), nullable=True))
        batch_op.add_column(sa.Column("rests_until", sa.DateTime(), nullable=True))
        batch_op.create_index(batch_op.f("ix_webhook_created_at_id"), ["created_at", "id"], unique=False)
    with op.batch_alter_table("webhook", schema=None) as batch_op:
        for column in _NOW:
            batch_op.alter_column(column.name, existing_type=column.type, existing_nullable=False, server_default=None)

    with op.batch_alter_table("webhook_delivery", schema=None) as batch_op:
        batch_op.create_index(
            batch_op.f("ix_webhook_delivery_webhook_id_created_at_id"), ["webhook_id", "created_at", "id"], unique=False
        )

    op.create_table(
        "webhook_attempt",
        sa.Column("id", sa.String(length=32), nullable=False),
        sa.Column("delivery_id", sa.String(length=32), nullable=False),
        sa.Column("started_at", sa.DateTime(), nullable=False),
        sa.Column("duration_s", sa.Double(), nullable=False),
        sa.Column("status_code", sa.Integer(), nullable=True),
        sa.Column("error", sa.Text(), nullable=False),
        sa.Column("response", sa.Text(), nullable=False),
        sa.ForeignKeyConstraint(
            ["delivery_id"],
            ["webhook_delivery.id"],
            name=op.f("fk_webhook_attempt_delivery_id_webhook_delivery"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_webhook_attempt")),
    )
    with op.batch_alter_table("webhook_attempt", schema=None) as batch_op:
        batch_op.create_index(batch_op.f("ix_webhook_attempt_delivery_id_id"), ["delivery_id", "id"], unique=False)

    op.create_table(
        "step_stat",
        sa.Column("stage", sa.String(length=100), nullable=False),
        sa.Column("outcome", sa.String(length=100), nullable=False),
        sa.Column("bucket", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("steps", sa.BigInteger(), nullable=False),
        sa.Column("seconds", sa.Double(), nullable=False),
        sa.PrimaryKeyConstraint("stage", "outcome", "bucket", name=op.f("pk_step_stat")),
    )

    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.add_column(sa.Column("traceparent", sa.String(length=55), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.drop_column("traceparent")

    op.drop_table("step_stat")
    with op.batch_alter_table("webhook_attempt", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_webhook_attempt_delivery_id_id"))

    op.drop_table("webhook_attempt")
    with op.batch_alter_table("webhook_delivery", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_webhook_delivery_webhook_id_created_at_id"))

    with op.batch_alter_table("webhook", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_webhook_created_at_id"))
        for name in ("rests_until", "failing_since", "old_secret_expires_at", "old_secret", "disabled_reason", "enabled"):
            batch_op.drop_column(name)
