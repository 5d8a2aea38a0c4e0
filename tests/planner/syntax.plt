:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(syntax)).

wipe(call(_, wipe, 'Wipe'(r))).

:- begin_tests(well_formed).

test('every construct is a program', forall(member(P, [[], [W, W], conc([W, []]), choice(_, c, [W, []]), test(all([])),
        pick(_, p, _, 'Robot', W), if(is_true(loc(_, ok)), W, []), while(not(holds(a, b, c)), W), until(W, any([])),
        foreach(_, e, [X-'Thing'], holds(dirty, X, true), _, W), pconc([W, W]), any_order(_, o, [W, []]), star(_, s, W),
        interrupt(_, i, [X-'Thing'], holds(dirty, X, true), W), interrupt(_, i, [], all([]), W), search(W), deadline(1, W),
        test(compare(less, value(weight, cup), 3)), test(not(same(cup, jug))), test(any([is_a(cup, 'Clay')])),
        test(some([V-'Thing', N], all([holds(weight, V, N), compare(less, plus(N, 1), times(N, minus(N, 2)))])))]))) :-
    wipe(W), well_formed(P).
test('a variable is none', throws(error(malformed_program(_, 'a program'), _))) :- well_formed([_]).
test('an unknown construct is none', throws(error(malformed_program(perhaps(_), 'a program'), _))) :-
    wipe(W), well_formed(conc([W, perhaps(W)])).
test('a runtime term is not written', throws(error(malformed_program(running(a), 'a program'), _))) :-
    well_formed([running(a)]).
test('branches come in a list', throws(error(malformed_program(W, 'a list of programs'), _))) :-
    wipe(W), well_formed(choice(_, c, W)).
test('a step has a name', throws(error(malformed_program(1, 'the name of a step'), _))) :-
    well_formed(call(_, 1, 'Wipe'(r))).
test('a pick has a variable', throws(error(malformed_program(r-'Robot', 'a Variable-Class'), _))) :-
    wipe(W), well_formed(pick(_, p, r, 'Robot', W)).
test('a for-each has variables', throws(error(malformed_program([], 'a list of Variable-Class'), _))) :-
    wipe(W), well_formed(foreach(_, e, [], all([]), _, W)).
test('a condition is one of nine', throws(error(malformed_program(maybe, 'a condition'), _))) :-
    wipe(W), well_formed(if(all([maybe]), W, [])).
test('a truth value has a place', throws(error(malformed_program(is_true(yes), 'a condition'), _))) :-
    well_formed(test(is_true(yes))).
test('a deadline is some milliseconds', [forall(member(Ms, [0, -1, 1.5, soon])),
                                        throws(error(malformed_program(Ms, 'a positive number of milliseconds'), _))]) :-
    wipe(W), well_formed(deadline(Ms, W)).
test('numbers and values are compared', [forall(member(X, [weight, _, loc(f, n)])),
                                         throws(error(malformed_program(_, 'a comparison of numbers or values'), _))]) :-
    well_formed(test(compare(less, X, 3))).
test('some has variables', [forall(member(Vs, [[], x, [x], [cup-'Thing'], [_-3]])), throws(error(malformed_program(_, _), _))]) :-
    well_formed(test(some(Vs, all([])))).
test('a number that nothing draws is not compared', throws(error(malformed_program(_, 'a comparison of numbers or values'), _))) :-
    well_formed(test(all([some([N], holds(weight, cup, N)), compare(less, N, 3)]))).
test('comparisons are five', throws(error(malformed_program(compare(about, 1, 2), 'a condition'), _))) :-
    well_formed(test(compare(about, 1, 2))).
test('an interrupt has something to do', throws(error(malformed_program(_, 'a loop with something to do every time'), _))) :-
    well_formed(interrupt(_, i, [], all([]), [])).
test('so has an iteration', throws(error(malformed_program(_, 'a loop with something to do every time'), _))) :-
    wipe(W), well_formed(star(_, s, choice(_, c, [W, []]))).
test('a loop has something to do every time',
     [forall(member(P, [[], [if(all([]), W, [])], choice(f, c, [W, []]), conc([]), test(all([])), pconc([test(all([]))]),
                        any_order(f, o, [[]]), star(f, s, W), interrupt(f, i, [], all([]), W), search([]), deadline(9, [])])),
      throws(error(malformed_program(while(all([]), P), _), _))]) :-
    wipe(W), well_formed(while(all([]), P)).

:- end_tests(well_formed).

:- begin_tests(definitions, [setup(load_facts([definition(d, 'Main', F, [call(F, a, 'Wipe'(r)), call(F, b, 'Bad')]),
                                               duration(d, 'Wipe'(_), fixed(1)), definition(d, 'Bad', _, oops),
                                               definition(d, 'Stray', G, call(G, a, 'Missing'))], _)),
                             cleanup(drop_facts(d, _))]).

test('a step is well-formed') :- well_formed(d, 'Wipe'(r)).
test('what is called must be too', throws(error(malformed_program(oops, 'a program'), _))) :- well_formed(d, 'Main').
test('what is called must exist', throws(error(malformed_program('Missing', 'the head of a process'), _))) :-
    well_formed(d, 'Stray').
test('what comes back to itself is refused', throws(error(malformed_program(_, 'a process that does not come back to itself'), _))) :-
    setup_call_cleanup(load_facts([definition(d, 'Round', H, [call(H, a, 'Again')]), definition(d, 'Again', J, [call(J, b, 'Round')])], _),
                       well_formed(d, 'Round'),
                       ( retractall(kb_facts:definition(d, 'Round', _, _)), retractall(kb_facts:definition(d, 'Again', _, _)) )).
test('the error says what is wrong', Text == "malformed program: oops is not a program") :-
    catch(well_formed(d, 'Main'), Error, true),
    message_to_codes(Error, Text).

:- end_tests(definitions).

message_to_codes(Error, Text) :-
    '$messages':translate_message(Error, Lines, []),
    with_output_to(string(Text0), print_message_lines(current_output, '', Lines)),
    normalize_space(string(Text), Text0).
