"""Examples of the OpenAPI document, by operation: one product on its way from upload to bill of materials."""

from collections.abc import Mapping
from typing import Any

_IDENTITY = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
_RAISED = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 120.0], [0.0, 0.0, 0.0, 1.0]]
_PRODUCT_ID, _DESIGN_ID, _WEBHOOK_ID, _DELIVERY_ID, _WORKER_ID = (f"0199c0de00007a1b2c3d4e5f60718{k}" for k in range(293, 298))
_FIRST, _LATER = "2026-01-31T12:00:00Z", "2026-01-31T12:00:30Z"
_SHA256 = "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"

_REGION = {"note": "", "reason": "gear teeth", "box": {"min": [-40.0, -40.0, 0.0], "max": [40.0, 40.0, 9.0]}, "segments": []}
_COMPONENT = {
    "id": "rotor",
    "part_number": "CP-1303",
    "revision": "A",
    "name": "Rotor",
    "file": "rotor.stl",
    "units": "mm",
    "pose": _IDENTITY,
    "density": 7850.0,
    "friction": 0.2,
    "texture": "machined",
    "ferrous": True,
    "no_grasp": [_REGION],
    "may_grasp": [],
    "external_ids": {"plm": "4712"},
    "faces": 2104,
    "bounds": {"min": [-30.0, -30.0, 0.0], "max": [30.0, 30.0, 14.0]},
    "mesh": f"/api/v1/products/{_PRODUCT_ID}/components/rotor/mesh.glb",
}
_OPERATION = {"id": "op-01", "active": ["rotor"], "pose_before": _RAISED, "pose_after": _IDENTITY}
_OPERATION_VIEW = {"note": "", "passive": [], "waypoints": [], "grasp": None, "force": 0.0, "fit": None, **_OPERATION}
_REFERENCE = {
    "id": _PRODUCT_ID,
    "part_number": "CP-1300",
    "revision": "A",
    "name": "Coolant pump",
    "external_ids": {"plm": "4711"},
}
_CHANGES = {"version": 1, "created_at": _FIRST, "updated_at": _FIRST}
_SUMMARY = {**_REFERENCE, "components": 1, "operations": 1, **_CHANGES}
_PRODUCT = {
    **_REFERENCE,
    "components": [_COMPONENT],
    "environment": [],
    "operations": [_OPERATION_VIEW],
    "warnings": [],
    **_CHANGES,
}
_PAGE = {"next_cursor": None, "next_updated_since": "2026-01-31T11:59:30Z"}

_QUEUED = {"fraction": 0.0, "stage": "", "message": ""}
_DONE = {"fraction": 1.0, "stage": "done", "message": "the design is complete"}
_OPTIONS = {"margin": 0.2, "actuators": "all"}
_ENDED = {"created_at": _FIRST, "updated_at": _LATER, "finished_at": _LATER}
_DESIGN_OF = {"id": _DESIGN_ID, "product_id": _PRODUCT_ID, "product_version": 1, "status": "complete", "progress": _DONE}
_DESIGN = {
    **_DESIGN_OF,
    "options": _OPTIONS,
    "design": {"product": {"part_number": "CP-1300", "revision": "A"}, "status": "complete", "grippers": []},
    "files": [
        {
            "path": "bom.csv",
            "href": f"/api/v1/designs/{_DESIGN_ID}/files/bom.csv",
            "size": 1024,
            "sha256": _SHA256,
            "media_type": "text/csv; charset=utf-8",
        }
    ],
    "problem": None,
    **_ENDED,
}
_DESIGN_SUMMARY = {
    **_DESIGN_OF,
    "href": f"/api/v1/designs/{_DESIGN_ID}",
    "part_number": "CP-1300",
    "revision": "A",
    "options": _OPTIONS,
    **_ENDED,
}
_JOB = {
    "id": _DESIGN_ID,
    "design": f"/api/v1/designs/{_DESIGN_ID}",
    "product_id": _PRODUCT_ID,
    "part_number": "CP-1300",
    "revision": "A",
    "status": "succeeded",
    "outcome": "complete",
    "progress": _DONE,
    "attempt": 1,
    "priority": 5,
    "deadline_at": None,
    "not_before": None,
    "cancel_requested": False,
    "problem": None,
    "started_at": _FIRST,
    **_ENDED,
}
_QUEUED_JOB = {**_JOB, "status": "queued", "outcome": None, "progress": _QUEUED, "started_at": None, "finished_at": None}
_CANCELLED_JOB = {**_QUEUED_JOB, "status": "cancelled", "finished_at": _LATER}
_ACCEPTED = {"id": _DESIGN_ID, "product_id": _PRODUCT_ID, "status": "queued", "job": f"/api/v1/jobs/{_DESIGN_ID}"}

_FIGURES = {"gripper_type": "centric-3", "stroke": 10.0, "grip_force": 120.0, "confidence": "A", "source": "data sheet"}
_UNKNOWN = ("opening_max", "mass", "finger_length_max", "finger_mass_max", "body_diameter", "body_length", "price", "not_used")
_BASES = {"stroke_basis": "total", "force_basis": "total", "note": ""}
_NAMED = {"maker": "Acme", "model": "C-10"}
_TOTALS = {"stroke": 10.0, "grip_force": 120.0}
_ACTUATOR = {**_NAMED, **_FIGURES, **_BASES, **dict.fromkeys(_UNKNOWN), "updated_at": _FIRST}
_PLUGIN = {
    "kind": "segmenter",
    "name": "sdf",
    "version": "1.0.0",
    "distribution": "gripwright",
    "summary": "Segments by the shape diameter function.",
    "options": {"type": "object", "properties": {"rays": {"type": "integer", "default": 30}}},
    "warnings": [],
}
_PLAN_SCHEMA = {"type": "object", "properties": {"segmenter": {"type": "string", "default": "sdf", "x-plugins": "segmenter"}}}
_WEBHOOK = {"id": _WEBHOOK_ID, "url": "https://plm.example/hooks", "events": ["design.complete"], "created_at": _FIRST}
_CREATED = {**_WEBHOOK, "secret": "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw"}
_SUBSCRIBER = {**_WEBHOOK, "enabled": True, "disabled_reason": "", "failing_since": None, "old_secret_expires_at": None}
_DELIVERY = {"id": _DELIVERY_ID, "attempts": 1, "detail": "", "next_attempt_at": None, "created_at": _FIRST}
_DELIVERED, _PENDING = {**_DELIVERY, "status": "delivered"}, {**_DELIVERY, "status": "pending", "next_attempt_at": _FIRST}
_PAYLOAD = '{"type":"design.complete","timestamp":"2026-01-31T12:00:30Z","data":{}}'
_ATTEMPT = {"started_at": _FIRST, "duration_s": 0.12, "status_code": 204, "error": "", "response": ""}
_IMPACT_PATHS = {"earlier_design": f"/api/v1/designs/{_DESIGN_ID}", "design": f"/api/v1/designs/{_WEBHOOK_ID}"}
_IMPACT = {
    "operations": [{"id": "op-01", "outcome": "held", "before": "G1", "after": "G1", "detail": None}],
    "grippers": [{"id": "G1", "name": "G1", "holds": ["op-01"], "no_longer_holds": []}],
    "new_grippers": [],
    "components": [{"id": "rotor", "outcome": "unchanged", "segments": []}],
}
_IMPORTED: dict[str, Any] = {"part_number": "CP-1300", "revision": "A", "product_id": _PRODUCT_ID, "detail": None, "errors": []}
_UNREADABLE = {
    "name": "valve.zip",
    "outcome": "refused",
    "part_number": None,
    "revision": None,
    "product_id": None,
    "detail": "the product package cannot be used",
    "errors": [{"pointer": "/components/1/file", "message": "no file 'seat.stl' in the package"}],
}
_ALTERNATIVE = {"gripper_type": "centric-3", "opening_width": 124.9, "finger_length_min": 10, "finger_length_max": None}
_GRIPPER = {"gripper_type": "centric-3", "fingers": 3, "opening_min": 116.9, "opening_max": 124.9, "finger_length": 10}

REQUESTS: Mapping[str, Any] = {
    "patch_product": {"name": "Coolant pump", "external_ids": {"plm": "4711", "erp": None}},
    "patch_component": {"friction": 0.15, "no_grasp": [{"reason": "gear teeth", "box": _REGION["box"]}]},
    "put_operations": {"operations": [_OPERATION]},
    "create_design": {"options": _OPTIONS},
    "create_change_impact": {"revision": _PRODUCT_ID},
    "minimise_gripper_set": {
        "strokes": {"parallel-2": 48, "centric-3": 8},
        "release_clearance": 0,
        "components": [{"id": "1", "alternatives": [_ALTERNATIVE]}],
    },
    "put_actuator": _FIGURES,
    "create_webhook": {"url": "https://plm.example/hooks", "events": ["design.complete"]},
    "change_webhook": {"enabled": True},
    "rotate_webhook_secret": {"overlap_s": 86400},
    "change_job": {"priority": 9},
}
"""JSON bodies."""

RESPONSES: Mapping[str, Mapping[str, Any]] = {
    "create_product": {"201": _PRODUCT, "200": _PRODUCT},
    "import_products": {"200": {"dry_run": True, "items": [{"name": "pump.zip", "outcome": "exists", **_IMPORTED}, _UNREADABLE]}},
    "list_products": {"200": {"items": [_SUMMARY], **_PAGE}},
    "get_product": {"200": _PRODUCT},
    "patch_product": {"200": _PRODUCT},
    "put_operations": {"200": _PRODUCT},
    "list_components": {"200": {"items": [_COMPONENT]}},
    "get_component": {"200": _COMPONENT},
    "patch_component": {"200": _COMPONENT},
    "create_design": {"202": _ACCEPTED, "201": _DESIGN},
    "list_designs": {"200": {"items": [_DESIGN_SUMMARY], **_PAGE}},
    "list_product_designs": {"200": {"items": [_DESIGN_SUMMARY], **_PAGE}},
    "get_design": {"200": _DESIGN},
    "get_design_bom": {
        "200": {
            "product": _REFERENCE,
            "items": [
                {"gripper": "G1", "item": "actuator", "make_or_buy": "buy", "maker": "Acme", "model": "C-10", "quantity": 1}
            ],
        }
    },
    "create_change_impact": {
        "200": {**_IMPACT_PATHS, "status": "complete", "impact": _IMPACT},
        "202": {**_IMPACT_PATHS, "status": "queued", "impact": None},
    },
    "list_jobs": {"200": {"items": [_JOB], **_PAGE}},
    "get_job": {"200": _JOB},
    "change_job": {"200": {**_QUEUED_JOB, "priority": 9}},
    "cancel_job": {"202": _CANCELLED_JOB},
    "retry_job": {"202": {**_QUEUED_JOB, "attempt": 2}},
    "minimise_gripper_set": {
        "200": {"grippers": [{**_GRIPPER, "components": ["1"]}], "lower_bound": 1, "proven": True, "uncoverable": []}
    },
    "list_plugins": {"200": {"items": [_PLUGIN], "failures": [], "plan": _PLAN_SCHEMA}},
    "get_plugin": {"200": _PLUGIN},
    "list_actuators": {"200": {"items": [_ACTUATOR]}},
    "get_actuator": {"200": _ACTUATOR},
    "put_actuator": {"200": _ACTUATOR, "201": _ACTUATOR},
    "import_actuators": {
        "200": {
            "dry_run": False,
            "items": [{**_NAMED, **_TOTALS, "gripper_type": "centric-3", "confidence": "B", "note": "", "outcome": "added"}],
            "errors": [],
        }
    },
    "create_webhook": {"201": _CREATED},
    "get_webhook": {"200": {**_SUBSCRIBER, "deliveries": [_DELIVERED]}},
    "list_webhooks": {"200": {"items": [_SUBSCRIBER], "next_cursor": None}},
    "change_webhook": {"200": _SUBSCRIBER},
    "rotate_webhook_secret": {"200": _CREATED},
    "test_webhook": {"202": _PENDING},
    "list_webhook_deliveries": {"200": {"items": [_DELIVERED], "next_cursor": None}},
    "get_webhook_delivery": {
        "200": {
            **_DELIVERED,
            "payload": '{"type":"design.complete","timestamp":"2026-01-31T12:00:30Z","data":{}}',
            "log": [_ATTEMPT],
        }
    },
    "redeliver_webhook_delivery": {"202": _PENDING},
    "list_workers": {
        "200": {
            "items": [
                {
                    "id": _WORKER_ID,
                    "host": "worker-1",
                    "pid": 7,
                    "version": "0.1.0",
                    "state": "live",
                    "steps": 1,
                    "started_at": _FIRST,
                    "heartbeat_at": _LATER,
                }
            ]
        }
    },
    "list_audit": {
        "200": {
            "items": [
                {
                    "at": _FIRST,
                    "actor": f"key:{_WEBHOOK_ID}",
                    "actor_name": "plm",
                    "client": "192.0.2.7",
                    "method": "POST",
                    "path": f"/api/v1/products/{_PRODUCT_ID}/designs",
                    "status": 202,
                    "resource_id": _DESIGN_ID,
                    "request_id": "5f2b8c",
                }
            ],
            "next_cursor": None,
        }
    },
    "health_live": {"200": {"status": "ok"}},
    "health_ready": {"200": {"status": "ok"}},
}
"""JSON answers, by status."""

PROBLEM = {
    "type": "urn:gripwright:problem:invalid-input",
    "title": "Unprocessable Entity",
    "status": 422,
    "detail": "the request cannot be used",
    "errors": [{"pointer": "/query/limit", "message": "Input should be less than or equal to 200"}],
}
"""An error."""
