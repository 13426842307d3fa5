from soak.api_contract import check


def test_answers_are_as_the_openapi_document_says():
    outcome = check(examples=4, seed=1, phases="fuzzing")

    assert outcome.is_clean, outcome.output
    assert outcome.requests >= 150
