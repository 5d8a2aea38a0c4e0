:- use_module(library(plunit)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(replay)).
:- use_module(planner_golog(search)).
:- use_module(planner_golog(travel)).

% Fast takes 10, Slow 100; Fill makes full what Empty needs; one at a time passes a door.

shed :-
    load_facts(
        [ kind(e, r1, 'Robot'), kind(e, r2, 'Robot'),
          agent(e, 'Fast'(R1), R1), duration(e, 'Fast'(_), fixed(10)),
          agent(e, 'Slow'(R2), R2), duration(e, 'Slow'(_), fixed(100)),
          agent(e, 'Fill'(R3), R3), duration(e, 'Fill'(_), fixed(10)), effect(e, 'Fill'(_), fluent(full, tank), true),
          agent(e, 'Empty'(R4), R4), duration(e, 'Empty'(_), fixed(10)), effect(e, 'Empty'(_), fluent(full, tank), false),
          precondition(e, 'Empty'(_), holds(full, tank, true)),
          agent(e, 'Pass'(R5, _), R5), claims(e, 'Pass'(_, D5), D5), duration(e, 'Pass'(_, _), fixed(20)),
          duration(e, 'Scan'(_), fixed(5)), claims(e, 'Scan'(D6), D6)
        ], _).

shed_gone :- drop_facts(e, _).

looking(S) :- no_travel(Travel), situation(e, plan(Travel), 2, 50, S).
replayed(P, Choices, Steps, Result) :-
    looking(S), mode(S, plan(Travel)), proposed_guide(Choices, Steps, Guide), replay(P, S, Travel, Guide, Result).
times(Events, Times) :- findall(Id-From, member(started(Id, _, _, From, _), Events), Times).

fast(Id, R, call(f, Id, 'Fast'(R))).

:- begin_tests(replay, [setup(shed), cleanup(shed_gone)]).

test('steps begin as early as their order lets them', M-Times == 110-['f/b'-50, 'f/a'-150]) :-
    fast(a, r1, P), replayed(conc([P, call(f, b, 'Slow'(r1))]), [], ['f/b'-[r1], 'f/a'-[r1]], plan(M, Events, [])), times(Events, Times).
test('the choices are those of the guide', M == 100) :-
    fast(a, r1, P), replayed(choice(f, c, [P, call(f, b, 'Slow'(r1))]), ['f/c'-2], ['f/b'-[r1]], plan(M, _, [])).
test('where it says nothing, the first choice that is possible', M == 10) :-
    fast(a, r1, P), replayed(choice(f, c, [P, call(f, b, 'Slow'(r1))]), [], [], plan(M, _, [])).
test('an iteration goes on as often as it says', M == 20) :-
    fast(a, r1, P), replayed(star(f, s, P), ['f/s/0'-again, 'f/s/1'-again], ['f/a'-[r1], 'f/a'-[r1]], plan(M, _, [])).
test('nothing takes no time', R == plan(0, [], [])) :- replayed([], [], [], R).
test('it ends where only acting tells how to go on', M-Ls == 10-[loc(f, x)]) :-
    fast(a, r1, P), replayed([P, if(is_true(loc(f, x)), P, [])], [], ['f/a'-[r1]], plan(M, _, Ls)).
test('a step that waits for the effect of another branch is woken', Times == ['f/b'-50, 'f/a'-60]) :-
    replayed(conc([call(f, a, 'Empty'(r1)), call(f, b, 'Fill'(r2))]), [], ['f/b'-[r2], 'f/a'-[r1]], plan(20, Events, [])), times(Events, Times).
test('so is a computation that waits for a resource', Times == ['f/a'-50, 'f/b'-50, 'f/c'-55]) :-
    replayed(conc([call(f, a, 'Slow'(r1)), call(f, b, 'Scan'(door)), call(f, c, 'Scan'(door))]), [],
             ['f/a'-[r1], 'f/b'-[resource(door)], 'f/c'-[resource(door)]], plan(100, Events, [])), times(Events, Times).
test('a resource serves in the order of the guide', Times == ['f/b'-50, 'f/a'-70]) :-
    replayed(conc([call(f, a, 'Pass'(r1, door)), call(f, b, 'Pass'(r2, door))]), [],
             ['f/b'-[r2, resource(door)], 'f/a'-[r1, resource(door)]], plan(40, Events, [])), times(Events, Times).

test('stuck: a robot waits for itself', Ids == ['f/a', 'f/b']) :-
    fast(a, r1, P), fast(b, r1, Q), replayed([P, Q], [], ['f/b'-[r1], 'f/a'-[r1]], stuck(Ids)).
test('stuck: two wait for each other', Ids == ['f/a', 'f/b']) :-
    P = [call(f, a, 'Pass'(r1, door)), test(holds(full, tank, true))], Q = [call(f, b, 'Pass'(r2, door))],
    replayed([P, Q], [], ['f/b'-[r2, resource(door)], 'f/a'-[r1, resource(door)]], stuck(Ids)).
test('stuck: a precondition that nothing makes hold', Ids == ['f/a']) :-
    replayed(call(f, a, 'Empty'(r1)), [], ['f/a'-[r1]], stuck(Ids)).
test('stuck: a branch that there is not', R == stuck([])) :- fast(a, r1, P), replayed(choice(f, c, [P]), ['f/c'-2], [], R).
test('stuck: too late', Ids == ['f/a']) :- replayed(deadline(90, call(f, a, 'Slow'(r1))), [], ['f/a'-[r1]], stuck(Ids)).
test('stuck: a test that never holds', R == stuck([])) :- replayed(test(holds(full, tank, true)), [], [], R).

test('what the search has found replays in the same time, no step later', true((M == N, Late == []))) :-
    P = conc([[pick(f, p, R, 'Robot', call(f, a, 'Slow'(R))), call(f, b, 'Empty'(r1))], call(f, d, 'Fill'(r1)),
              any_order(f, o, [call(f, x, 'Fast'(r2)), call(f, y, 'Pass'(r2, door))])]),
    looking(S), best_plan(P, S, 1000, plan(optimal, M, M, Found, [], _)), guide(Found, S, Guide), mode(S, plan(Travel)),
    replay(P, S, Travel, Guide, plan(N, Replayed, [])), times(Found, Before), times(Replayed, After),
    findall(Id, ( member(Id-T, Before), memberchk(Id-U, After), U > T ), Late).

:- end_tests(replay).
