:- use_module(library(plunit)).
:- use_module(library(assoc)).
:- use_module(kb_rules(facts)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).
:- use_module(planner_golog(guide)).
:- use_module(planner_golog(horizon)).
:- use_module(planner_golog(settling)).
:- use_module(planner_golog(transition)).
:- use_module(planner_golog(travel)).

% A small workshop: two robots, of which bert has an arm; anna and bert wipe, only bert polishes.

workshop :-
    load_facts(
        [ kind(w, anna, 'Robot'), kind(w, bert, 'Robot'), kind(w, bert, 'RobotWithArm'),
          kind(w, cup, 'Thing'), kind(w, jug, 'Thing'), kind(w, p1, 'Place'),
          value(w, madeOf, cup, clay), fluent(w, dirty, cup, true),
          agent(w, 'Wipe'(R1, _), R1),
          duration(w, 'Wipe'(_, _), fixed(30)), effect(w, 'Wipe'(_, T1), fluent(dirty, T1), false),
          agent(w, 'Polish'(R2, _), R2), duration(w, 'Polish'(_, _), fixed(50)),
          requires(w, 'Polish', 'RobotWithArm'), precondition(w, 'Polish'(_, T2), holds(dirty, T2, false)),
          duration(w, 'Count', fixed(10)),
          agent(w, 'Tidy'(R3, _), R3), keeps_robot(w, 'Tidy'), effect(w, 'Tidy'(_, T3), fluent(tidy, T3), true),
          definition(w, 'Tidy'(R4, T4), F4, [call(F4, wipe, 'Wipe'(R4, T4)), call(F4, count, 'Count')]),
          precondition(w, 'Guarded', holds(open, door, true)),
          definition(w, 'Guarded', F5, call(F5, count, 'Count')),
          definition(w, 'Idle', _, []), effect(w, 'Idle', fluent(idled, it), true),
          definition(w, 'Pose'(_), _, []), agent(w, 'Pose'(R9), R9), requires(w, 'Pose', 'RobotWithArm'),
          agent(w, 'Go'(R6, _), R6), duration(w, 'Go'(R6b, P6), travel(R6b, P6, 5)),
          effect(w, 'Go'(R6c, P6c), fluent(locatedAt, R6c), P6c),
          definition(w, 'Go'(R7, _), F7, until(call(F7, drive, 'Drive'(R7)), is_true(loc(F7, arrived)))),
          agent(w, 'Drive'(R8), R8), duration(w, 'Drive'(_), fixed(1))
        ], _).

workshop_gone :- drop_facts(w, _).

acting(S) :- empty_assoc(E), situation(w, act(guide(E, E)), 2, 0, S).
looking_ahead(S) :- travel(tables([p1], [robot(anna, 1, [40])], [[[0]]]), Travel), situation(w, plan(Travel), 2, 0, S).
alone(S) :- empty_assoc(E), situation(w, act(guide(E, E)), 1, 0, S).

started(P, S, Steps) :-
    findall(Id-Agent, ( trans(P, S, _, T), log(T, [started(Id, _, Agents, _, _)|_]), ( Agents == [] -> Agent = none ; atomic_list_concat(Agents, +, Agent) ) ), Steps).

% Id has ended; what then is settled.
ended(Id, P, S0, Q, S) :- stop(Id, S0, S1), settle(P, S1, Q, S).

wipe(call(f, w1, 'Wipe'(anna, cup))).
other(call(f, w2, 'Wipe'(bert, jug))).

:- begin_tests(sequence, [setup(workshop), cleanup(workshop_gone)]).

test('the second part waits for the first', all(Ids == [['f/w1'-anna]])) :-
    wipe(P), other(Q), acting(S), started([P, Q], S, Ids).
test('the second part begins when the first has ended', Ids == ['f/w2'-bert]) :-
    wipe(P), other(Q), acting(S), trans([P, Q], S, R, T), !,
    ended('f/w1', R, T, R1, T1), started(R1, T1, Ids).
test('nothing in a row is final') :- acting(S), once(final([], S)), once(final([[], []], S)).
test('a row with a step is not final', fail) :- wipe(P), acting(S), final([[], P], S).

:- end_tests(sequence).

:- begin_tests(test, [setup(workshop), cleanup(workshop_gone)]).

test('what is known lets the program go on', Ids == ['f/w1'-anna]) :-
    wipe(P), acting(S), started([test(holds(dirty, cup, true)), P], S, Ids).
test('what is not known holds it up', Ids == []) :-
    wipe(P), acting(S), started([test(holds(dirty, jug, true)), P], S, Ids).
test('a test binds what it finds', Ids == ['f/w1'-anna]) :-
    acting(S), started([test(holds(dirty, X, true)), call(f, w1, 'Wipe'(anna, X))], S, Ids).

:- end_tests(test).

:- begin_tests(conditional, [setup(workshop), cleanup(workshop_gone)]).

test('if the condition holds, the first branch', Ids == ['f/w1'-anna]) :-
    wipe(P), other(Q), acting(S), started(if(holds(dirty, cup, true), P, Q), S, Ids).
test('else the second', Ids == ['f/w2'-bert]) :-
    wipe(P), other(Q), acting(S), started(if(holds(dirty, jug, true), P, Q), S, Ids).
test('if nothing is to be done then, it is final') :-
    wipe(P), acting(S), once(final(if(holds(dirty, jug, true), P, []), S)).
test('looking ahead, it halts at what only acting finds out', Ls == [loc(f, ok)]) :-
    wipe(P), looking_ahead(S), If = if(is_true(loc(f, ok)), P, []),
    \+ trans(If, S, _, _), \+ final(If, S), halted(If, S, Ls).
test('acting, what has not been found out is false', Ids == []) :-
    wipe(P), acting(S), started(if(is_true(loc(f, ok)), P, []), S, Ids).
test('acting, what has been found out counts', Ids == ['f/w1'-anna]) :-
    wipe(P), acting(S0), set_data(loc(f, ok), true, S0, S), started(if(is_true(loc(f, ok)), P, []), S, Ids).

:- end_tests(conditional).

:- begin_tests(loops, [setup(workshop), cleanup(workshop_gone)]).

test('while repeats as long as the condition holds', Ids == ['f/w1'-anna]) :-
    wipe(P), acting(S), Loop = while(holds(madeOf, cup, clay), P),
    trans(Loop, S, R, T), !, ended('f/w1', R, T, R1, T1),
    R1 == Loop, started(R1, T1, Ids).
test('while is over when its condition does not hold', Ids-R1 == []-[]) :-
    wipe(P), acting(S), trans(scope(f, 'Idle', while(holds(dirty, cup, true), P)), S, R, T), !,
    stop('f/w1', T, T1), apply_effects('Wipe'(anna, cup), T1, T2),
    settle(R, T2, R1, T3), started(R1, T3, Ids).
test('while leaves its variables free for the next turn', Y == 1) :-
    acting(S), trans(while(holds(madeOf, X, clay), call(f, count, 'Count')), S, _, _), !,
    ( var(X) -> Y = 1 ; Y = 0 ).
test('until does its body before its condition is asked', Ids == ['f/w1'-anna]) :-
    wipe(P), acting(S), started(until(P, holds(madeOf, cup, clay)), S, Ids).
test('until ends where its condition holds', true(R1 == [])) :-
    wipe(P), acting(S), trans(scope(f, 'Idle', until(P, holds(madeOf, cup, clay))), S, R, T), !,
    ended('f/w1', R, T, R1, _).
test('until repeats where it does not', Ids == ['f/w1'-anna]) :-
    wipe(P), acting(S), trans(until(P, is_true(loc(f, ok))), S, R, T), !,
    ended('f/w1', R, T, R1, T1), started(R1, T1, Ids).
test('until of nothing does not turn for ever', Ids == []) :-
    acting(S), started(until([], is_true(loc(f, ok))), S, Ids).
test('10,000 turns leave program and situation as small as before', true((Ids == ['f/w1'-anna], Grown < 20))) :-
    wipe(P), acting(S), Loop = scope(f, 'Idle', until(P, is_true(loc(f, ok)))),
    turns(10, Loop, S, L1, S1), term_size(L1-S1, Before),
    turns(10_000, L1, S1, L2, S2), term_size(L2-S2, After),
    Grown is After - Before, started(L2, S2, Ids).

turns(0, P, S, P, S) :- !.
turns(N, P, S, Q, T) :-
    trans(P, S, P1, S1), !,
    stop('f/w1', S1, S2), apply_effects('Wipe'(anna, cup), S2, S3),
    set_data(loc(f, ok), false, S3, S4),
    settle(P1, S4, P2, S5), take_log(S5, _, S6),
    N1 is N - 1,
    turns(N1, P2, S6, Q, T).

:- end_tests(loops).

:- begin_tests(choices, [setup(workshop), cleanup(workshop_gone)]).

test('looking ahead, every branch may be taken', Ids == ['f/w1'-anna, 'f/w2'-bert]) :-
    wipe(P), other(Q), looking_ahead(S), started(choice(f, c, [P, Q]), S, Ids).
test('acting, the guide says which', Ids == ['f/w2'-bert]) :-
    wipe(P), other(Q), empty_assoc(E), list_to_assoc(['f/c'-[2]], Guide),
    situation(w, act(guide(Guide, E)), 2, 0, S), started(choice(f, c, [P, Q]), S, Ids).
test('a branch with nothing to do is a decision too', Chosen == [1, 2]) :-
    wipe(P), looking_ahead(S),
    findall(N, ( trans(choice(f, c, [P, []]), S, _, T), log(T, Log), memberchk(chose('f/c', N), Log) ), Chosen).
test('a choice is not over before it is taken', fail) :-
    looking_ahead(S), final(choice(f, c, [[], []]), S).
test('a choice without branches cannot be done', fail) :-
    looking_ahead(S), trans(choice(f, c, []), S, _, _).
test('a pick tries the individuals of its class, in order of name', Ids == ['f/w'-anna, 'f/w'-bert]) :-
    looking_ahead(S), started(pick(f, p, R, 'Robot', call(f, w, 'Wipe'(R, cup))), S, Ids).
test('a pick takes none of another class', Ids == []) :-
    looking_ahead(S), started(pick(f, p, R, 'Place', call(f, w, 'Polish'(R, cup))), S, Ids).
test('a pick leaves out what is excluded', Ids == ['f/w'-bert]) :-
    looking_ahead(S0), exclude('f/p', anna, S0, S),
    started(pick(f, p, R, 'Robot', call(f, w, 'Wipe'(R, cup))), S, Ids).
test('acting, the guide does not choose what is excluded', Ids == []) :-
    empty_assoc(E), list_to_assoc(['f/p'-[anna]], Guide),
    situation(w, act(guide(Guide, E)), 2, 0, S0), exclude('f/p', anna, S0, S),
    started(pick(f, p, R, 'Robot', call(f, w, 'Wipe'(R, cup))), S, Ids).
test('what is picked once stays picked', Ids == ['f/n'-none]) :-
    looking_ahead(S),
    trans(pick(f, p, R, 'Robot', [call(f, w, 'Wipe'(R, cup)), call(f, n, 'Count')]), S, Q, T), !,
    ended('f/w', Q, T, Q1, T1), Q1 = picked('f/p'-anna, _, _), started(Q1, T1, Ids).

:- end_tests(choices).

:- begin_tests(concurrency, [setup(workshop), cleanup(workshop_gone)]).

test('different robots act at once', Ids == ['f/w2'-bert]) :-
    wipe(P), other(Q), acting(S), trans(conc([P, Q]), S, R, T), !, started(R, T, Ids).
test('one robot does one thing at a time', Ids == []) :-
    wipe(P), acting(S), trans(conc([P, call(f, w3, 'Wipe'(anna, jug))]), S, R, T), !, started(R, T, Ids).
test('what needs no robot goes on beside anything', Ids == ['f/n'-none]) :-
    wipe(P), acting(S), trans(conc([P, call(f, n, 'Count')]), S, R, T), !, started(R, T, Ids).
test('it is over when all is over', Rs == [unfinished, []]) :-
    wipe(P), other(Q), acting(S), trans(conc([P, Q]), S, R, T), trans(R, T, R1, T1), !,
    ended('f/w1', R1, T1, R2, T2), ( R2 == [] -> A = [] ; A = unfinished ),
    ended('f/w2', R2, T2, R3, _), Rs = [A, R3].
test('a for-each has one turn for each individual that satisfies its condition', Ids == ['f/e/cup/w'-anna]) :-
    acting(S),
    started(foreach(f, e, [X-'Thing'], holds(dirty, X, true), I, call(I, w, 'Wipe'(anna, X))), S, Ids).
test('for-each goes over those of whom a condition does not hold', Ids == ['f/e/jug/w'-anna]) :-
    acting(S),
    started(foreach(f, e, [X-'Thing'], not(holds(dirty, X, true)), I, call(I, w, 'Wipe'(anna, X))), S, Ids).
test('a for-each over nothing is over') :-
    acting(S), once(final(foreach(f, e, [X-'Thing'], holds(broken, X, true), I, call(I, w, 'Wipe'(anna, X))), S)).
test('turns with the same first individual are told apart by all', Names == ['f/e/cup+anna', 'f/e/cup+bert']) :-
    acting(S),
    instances(f, e, [X-'Thing', _-'Robot'], holds(dirty, X, true), I-I, S, Names).

:- end_tests(concurrency).

:- begin_tests(calls, [setup(workshop), cleanup(workshop_gone)]).

test('a robot that lacks the capability does not begin', Ids == []) :-
    acting(S0), set_data(dirty-cup, false, S0, S), started(call(f, p, 'Polish'(anna, cup)), S, Ids).
test('nor does it end a process that has nothing to do', Who == [bert]) :-
    acting(S), findall(R, ( member(R, [anna, bert]), final(call(f, p, 'Pose'(R)), S) ), Who).
test('a capable one does', Ids == ['f/p'-bert]) :-
    acting(S0), set_data(dirty-cup, false, S0, S), started(call(f, p, 'Polish'(bert, cup)), S, Ids).
test('a precondition that does not hold keeps a step from beginning', Ids == []) :-
    acting(S), started(call(f, p, 'Polish'(bert, cup)), S, Ids).
test('a precondition keeps a composite process from beginning too', Ids == []) :-
    acting(S), started(call(f, g, 'Guarded'), S, Ids).
test('no more robots take part than may', Ids == []) :-
    wipe(P), other(Q), alone(S), trans(conc([P, Q]), S, R, T), !, started(R, T, Ids).
test('a process that is neither a step nor defined is an error', throws(error(existence_error(process, 'Fly'), _))) :-
    acting(S), trans(call(f, x, 'Fly'), S, _, _).
test('a composite process begins with its first step', Log == [begun('f/t', 'Tidy'(anna, cup)),
                                                               started('f/t/wipe', 'Wipe'(anna, cup), [anna], 0, 30)]) :-
    acting(S), trans(call(f, t, 'Tidy'(anna, cup)), S, _, T), !, take_log(T, Log, _).
test('its effects hold when it has ended, not before', Values == [[], [true]]) :-
    acting(S), trans(call(f, t, 'Tidy'(anna, cup)), S, R, T), !,
    ended('f/t/wipe', R, T, R1, T1), findall(V, fluent_value(tidy, cup, V, T1), Before),
    trans(R1, T1, R2, T2), !,
    ended('f/t/count', R2, T2, [], T3), findall(V, fluent_value(tidy, cup, V, T3), After),
    Values = [Before, After].
test('a process that keeps its robot keeps it between its steps', Ids == ['f/t/count'-none]) :-
    acting(S), trans(call(f, t, 'Tidy'(anna, cup)), S, R, T), !, ended('f/t/wipe', R, T, R1, T1),
    started(conc([R1, call(f, w3, 'Wipe'(anna, jug))]), T1, Ids).
test('and lets it go when it ends', Ids == ['f/w3'-anna]) :-
    acting(S), trans(call(f, t, 'Tidy'(anna, cup)), S, R, T), !, ended('f/t/wipe', R, T, R1, T1),
    trans(R1, T1, R2, T2), !, ended('f/t/count', R2, T2, _, T3),
    started(call(f, w3, 'Wipe'(anna, jug)), T3, Ids).
test('a composite process with nothing to do is settled, with its effects', R-Vs == []-[true]) :-
    acting(S), settle(call(f, i, 'Idle'), S, R, T), findall(V, fluent_value(idled, it, V, T), Vs).
test('looking ahead, a process with a duration model is one step', Steps == ['Go'-45]) :-
    looking_ahead(S), trans(call(f, g, 'Go'(anna, p1)), S, _, T), !,
    findall(N-End, ( log(T, Log), member(started(_, Head, _, _, End), Log), functor(Head, N, _) ), Steps).
test('looking ahead, a robot does not go where there is no way', fail) :-
    looking_ahead(S), trans(call(f, g, 'Go'(bert, p1)), S, _, _).
test('acting, it is expanded', Ids == ['f/g/drive'-anna]) :-
    acting(S), started(call(f, g, 'Go'(anna, p1)), S, Ids).
test('steps begin in the order of the plan', Ids == ['f/w3'-anna]) :-
    empty_assoc(E), list_to_assoc([anna-['f/w3', 'f/w1']], Order), situation(w, act(guide(E, Order)), 2, 0, S),
    wipe(P), started(conc([P, call(f, w3, 'Wipe'(anna, jug))]), S, Ids).

:- end_tests(calls).
