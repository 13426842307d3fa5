"""What integrators identify products by, and when products and jobs changed

Revision ID: 0003
Revises: 0002
"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "external_id",
        sa.Column("product_id", sa.String(length=32), nullable=False),
        sa.Column("system", sa.String(length=64), nullable=False),
        sa.Column("value", sa.String(length=200), nullable=False),
        sa.ForeignKeyConstraint(["product_id"], ["product.id"], name=op.f("fk_external_id_product_id"), ondelete="CASCADE"),
        sa.PrimaryKeyConstraint("product_id", "system", name=op.f("pk_external_id")),
    )
    op.create_index(op.f("ix_external_id_system_value"), "external_id", ["system", "value"], unique=False)
    op.create_index(op.f("ix_product_updated_at_id"), "product", ["updated_at", "id"], unique=False)
    op.add_column("job", sa.Column("updated_at", sa.DateTime(), nullable=True))
    op.execute("UPDATE job SET updated_at = coalesce(finished_at, started_at, created_at)")
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.alter_column("updated_at", existing_type=sa.DateTime(), nullable=False)
        batch_op.create_index(batch_op.f("ix_job_updated_at_id"), ["updated_at", "id"], unique=False)


def downgrade() -> None:
    with op.batch_alter_table("job", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_job_updated_at_id"))
        batch_op.drop_column("updated_at")
    op.drop_index(op.f("ix_product_updated_at_id"), table_name="product")
    op.drop_index(op.f("ix_external_id_system_value"), table_name="external_id")
    op.drop_table("external_id")
